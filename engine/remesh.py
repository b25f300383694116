"""Remeshing of a part of a mesh by pymeshlab, in the worker process."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64
from engine.errors import MeshError
from engine.files import limits
from engine.files.process import WorkerDiedError, WorkerSlowError, worker
from engine.mesh import Mesh
from engine.region import Region
from engine.run import Run

MOST_FACES = 5_000_000
INSET = 2


def remesh(mesh: Mesh, roi: ArrayLike, length: float, run: Run | None = None) -> Mesh:
    """Return the mesh with new, even triangles inside a region.

    Parameters
    ----------
    mesh : the mesh.
    roi : vertex ids of the region. Its outermost two rings of triangles stay as they are, so that
        everything outside it keeps its positions to the last bit.
    length : edge length to aim for, mesh units.
    run : progress and cancel.

    Raises
    ------
    MeshError
        The length is not positive or asks for too many triangles, the region is too thin, or
        pymeshlab failed.
    """
    region = Region(mesh, roi)
    chosen = _inner_faces(mesh, region.roi)
    if not chosen.any():
        raise MeshError("The region is too thin to be remeshed. Choose one of at least six rings.")
    area = np.linalg.norm(mesh.face_normals[chosen], axis=1).sum() / 2
    if not np.isfinite(length) or length <= 0 or 2.3 * area / length**2 > MOST_FACES:
        raise MeshError(
            f"An edge length of {length:g} cannot be used here. "
            f"Choose one above {float(np.sqrt(2.3 * area / MOST_FACES)):.3g}."
        )
    arrays = {"vertices": mesh.vertices, "faces": mesh.faces, "chosen": chosen}
    seconds = limits.seconds_for(200 * len(mesh.faces))
    try:
        _, found = worker.ask(
            {"job": "remesh", "name": "The mesh", "length": float(length)}, arrays, seconds, run
        )
    except (WorkerDiedError, WorkerSlowError):
        raise MeshError(
            "The remesher stopped without an answer. Choose a smaller region or longer edges."
        ) from None
    outside = mesh.topology.used_vertices.copy()
    outside[region.roi] = False
    vertices = _with_exact_rows(found["vertices"], mesh.vertices[outside], mesh.diagonal)
    return Mesh(vertices, found["faces"])


def _with_exact_rows(vertices: F64, kept: F64, diagonal: float) -> F64:
    """Return `vertices` with the rows that stand for `kept` (q, 3) put back to the last bit.

    pymeshlab hands untouched positions back with the last bits of near-zero coordinates changed.
    """
    distance, place = cKDTree(vertices).query(kept)
    if len(kept) and (distance.max() > 1e-12 * diagonal or len(np.unique(place)) < len(place)):
        raise MeshError(
            "Remeshing would have moved the mesh outside the region, so nothing was changed. "
            "Choose a larger region."
        )
    exact = vertices.copy()
    exact[place] = kept
    return exact


def _inner_faces(mesh: Mesh, roi: I64) -> B1:
    """Return the mask of faces whose corners lie more than `INSET` rings inside the region."""
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    for _ in range(INSET):
        near_outside = np.asarray(mesh.topology.adjacency @ (~inside).astype(np.float64)) > 0
        inside &= ~near_outside
    return np.asarray(inside[mesh.faces].all(axis=1))
