"""Regions made from regions: grown, shrunk, inverted, and with a smoother border.

All functions take and return ascending vertex ids, (m,) int64. An open border of the mesh is no
border of a region: nothing lies beyond it.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from engine.arrays import B1, I64
from engine.mesh import Mesh


def grow(mesh: Mesh, roi: I64, rings: int = 1) -> I64:
    """Return the region with `rings` more rings of neighbours around it."""
    inside = _mask(mesh, roi)
    for _ in range(rings):
        inside |= _next_to(mesh, inside)
    return np.flatnonzero(inside)


def shrink(mesh: Mesh, roi: I64, rings: int = 1) -> I64:
    """Return the region without its outermost `rings` rings; it may be empty."""
    outside = ~_mask(mesh, roi)
    for _ in range(rings):
        outside |= _next_to(mesh, outside)
    return np.flatnonzero(~outside)


def invert(mesh: Mesh, roi: I64) -> I64:
    """Return what the region leaves out of the connected parts of the mesh that it touches.

    Other parts stay out: who selects a knob and inverts means the rest of its housing, not the
    screws beside it.
    """
    parts = mesh.topology.components
    touched = np.isin(parts, np.unique(parts[roi]))
    return np.flatnonzero(touched & mesh.topology.used_vertices & ~_mask(mesh, roi))


def smooth_border(mesh: Mesh, roi: I64, rounds: int = 4) -> I64:
    """Return the region with the teeth of its border taken off.

    Its indicator function diffuses for some rounds, u_i <- (u_i + sum_j w_ij u_j / sum_j w_ij) / 2
    with w_ij = 1 / |e_ij|, and what is above one half is the region: the border moves towards its
    own centres of curvature, so notches fill and spikes go while a straight border stays. What
    is too small to survive is left as it was.
    """
    e = mesh.topology.edges
    length = np.linalg.norm(mesh.vertices[e[:, 0]] - mesh.vertices[e[:, 1]], axis=1)
    weight = 1.0 / np.maximum(length, 1e-9 * mesh.diagonal)
    i, j = np.concatenate([e, e[:, ::-1]]).T
    W = sp.csr_array((np.tile(weight, 2), (i, j)), shape=(mesh.n, mesh.n))
    total = W.sum(axis=1)
    u = _mask(mesh, roi).astype(np.float64)
    lonely = total == 0
    for _ in range(rounds):
        mean = np.divide(W @ u, total, out=u.copy(), where=~lonely)
        u = (u + mean) / 2
    smooth = np.flatnonzero(u > 0.5)
    return smooth if len(smooth) else np.unique(roi)


def rings_of(mesh: Mesh, share: float = 0.015) -> int:
    """Return how many rings make about `share` of the mesh's diagonal, at least one.

    On a fine mesh one ring is too small a step to see.
    """
    e = mesh.topology.edges
    length = np.linalg.norm(mesh.vertices[e[:, 0]] - mesh.vertices[e[:, 1]], axis=1)
    return max(1, round(share * mesh.diagonal / max(float(np.median(length)), 1e-300)))


def _mask(mesh: Mesh, roi: I64) -> B1:
    mask = np.zeros(mesh.n, dtype=bool)
    mask[roi] = True
    return mask


def _next_to(mesh: Mesh, inside: B1) -> B1:
    return np.asarray(mesh.topology.adjacency @ inside.astype(np.float64) > 0)
