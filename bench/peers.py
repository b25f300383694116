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
    begun = time.perf_counter()
    eigsh(K, k, M, sigma=0)
    return {"all": time.perf_counter() - begun, "memory GiB": peak_memory()}


def lapy_modes(m: int, k: int) -> Figures:
    """LaPy's Solver.eigs on the part of the surface that the region covers."""
    import lapy

    region = Region(*sheet(m))
    inside = (region.faces < region.m).all(axis=1)
    used, faces = np.unique(region.faces[inside], return_inverse=True)
    begun = time.perf_counter()
    solver = lapy.Solver(lapy.TriaMesh(region.x[used], faces.reshape(-1, 3)), lump=True)
    solver.eigs(k)
    return {"all": time.perf_counter() - begun, "memory GiB": peak_memory()}


def igl_base(m: int) -> Figures:
    """libigl's harmonic of order two, everything outside the region held."""
    import igl

    mesh, roi = sheet(m)
    held = np.setdiff1d(np.arange(mesh.n), roi)
    begun = time.perf_counter()
    igl.harmonic(mesh.vertices, mesh.faces, held, mesh.vertices[held], 2)
    return {"base": time.perf_counter() - begun, "memory GiB": peak_memory()}
