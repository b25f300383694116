"""The same tasks by other software, each in the form in which it is usually called."""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp

from bench.measures import Figures, peak_memory
from bench.surfaces import sheet
from engine import Region


def scipy_modes(m: int, k: int) -> Figures:
    """scipy.sparse.linalg.eigsh in shift-invert mode about 0."""
    from scipy.sparse.linalg import eigsh

    region = Region(*sheet(m))
    K, M = sp.csc_array(region.stiffness_roi), sp.csc_array(sp.diags_array(region.areas_roi))
    begun, begun_cpu = time.perf_counter(), time.process_time()
    eigsh(K, k, M, sigma=0)
    return _figures("all", begun, begun_cpu)


def lapy_modes(m: int, k: int) -> Figures:
    """LaPy's Solver.eigs on the part of the surface that the region covers."""
    import lapy

    region = Region(*sheet(m))
    inside = (region.faces < region.m).all(axis=1)
    used, faces = np.unique(region.faces[inside], return_inverse=True)
    begun, begun_cpu = time.perf_counter(), time.process_time()
    solver = lapy.Solver(lapy.TriaMesh(region.x[used], faces.reshape(-1, 3)), lump=True)
    solver.eigs(k)
    return _figures("all", begun, begun_cpu)


def igl_base(m: int) -> Figures:
    """libigl's harmonic of order two, everything outside the region held."""
    import igl

    mesh, roi = sheet(m)
    held = np.setdiff1d(np.arange(mesh.n), roi)
    begun, begun_cpu = time.perf_counter(), time.process_time()
    igl.harmonic(mesh.vertices, mesh.faces, held, mesh.vertices[held], 2)
    return _figures("base", begun, begun_cpu)


def _figures(name: str, begun: float, begun_cpu: float) -> Figures:
    return {
        name: time.perf_counter() - begun,
        "cpu": time.process_time() - begun_cpu,
        "memory GiB": peak_memory(),
    }
