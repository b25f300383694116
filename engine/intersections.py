"""Where a surface runs through itself, for the report after an edit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64
from engine.mesh import Mesh

# Edges that end on a triangle's plane, to this share of its size, only touch it.
_TOUCH = 1e-9
_EDGES = ((0, 1), (1, 2), (2, 0))


def self_intersections(mesh: Mesh, near: ArrayLike | None = None) -> I64:
    """Return pairs of faces that run through each other, (p, 2), smaller index first.

    Parameters
    ----------
    mesh : the surface.
    near : vertex ids; only pairs with a face at one of them are looked for. None looks everywhere.

    Notes
    -----
    Two faces that share an edge are not compared; two that share a corner cross when the edge
    opposite to it in one goes through the other. Faces that lie in one plane only touch.
    """
    faces = np.arange(len(mesh.faces))
    if near is not None:
        mask = np.zeros(mesh.n, dtype=bool)
        mask[np.asarray(near)] = True
        faces = np.flatnonzero(mask[mesh.faces].any(axis=1))
    pairs = _close_pairs(mesh, faces)
    shared = mesh.faces[pairs[:, 0]][:, :, None] == mesh.faces[pairs[:, 1]][:, None, :]
    apart = shared.sum(axis=(1, 2)) < 2
    pairs, shared = pairs[apart], shared[apart]
    crossing = _edges_cross(mesh, pairs[:, 0], pairs[:, 1], shared.any(axis=2))
    crossing |= _edges_cross(mesh, pairs[:, 1], pairs[:, 0], shared.any(axis=1))
    return np.asarray(np.unique(pairs[crossing], axis=0))


def _close_pairs(mesh: Mesh, faces: I64) -> I64:
    """Return pairs of faces whose bounding boxes overlap, one of each among `faces`."""
    corners = mesh.vertices[mesh.faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    middle, reach = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
    # Faces are compared by classes of size, so that a few large ones do not slow all down.
    classes = np.floor(np.log2(np.maximum(reach, 1e-300))).astype(np.int64)
    chosen = np.zeros(len(corners), dtype=bool)
    chosen[faces] = True
    sizes = [np.flatnonzero(classes == size) for size in np.unique(classes)]
    trees = [cKDTree(middle[those]) for those in sizes]
    found = [np.zeros(0, dtype=np.int64)]
    for mine in sizes:
        mine = mine[chosen[mine]]
        if len(mine) == 0:
            continue
        tree = cKDTree(middle[mine])
        for those, other in zip(sizes, trees, strict=True):
            apart = float(reach[mine].max() + reach[those].max())
            near = tree.sparse_distance_matrix(other, apart, output_type="ndarray")
            first, second = mine[near["i"]], those[near["j"]]
            overlap = (near["v"] <= reach[first] + reach[second]) & (first != second)
            first, second = first[overlap], second[overlap]
            boxes = (low[first] <= high[second]) & (low[second] <= high[first])
            first, second = first[boxes.all(axis=1)], second[boxes.all(axis=1)]
            found.append(np.minimum(first, second) * len(corners) + np.maximum(first, second))
    keys = np.unique(np.concatenate(found))
    return np.column_stack([keys // len(corners), keys % len(corners)])


def _edges_cross(mesh: Mesh, edged: I64, pierced: I64, shared: B1) -> B1:
    """Return whether an edge of the faces `edged` (p,) goes through the faces `pierced` (p,).

    Parameters
    ----------
    shared : (p, 3) which corners of `edged` belong to `pierced` too; edges at them only touch.
    """
    a, b, c = (mesh.vertices[mesh.faces[pierced, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    size = np.einsum("pa,pa->p", normal, normal)
    crosses = np.zeros(len(edged), dtype=bool)
    for i, j in _EDGES:
        p, q = mesh.vertices[mesh.faces[edged, i]], mesh.vertices[mesh.faces[edged, j]]
        above = np.einsum("pa,pa->p", p - a, normal)
        below = np.einsum("pa,pa->p", q - a, normal)
        limit = _TOUCH * size**0.75
        through = ((above > limit) & (below < -limit)) | ((above < -limit) & (below > limit))
        through &= ~(shared[:, i] | shared[:, j])
        t = np.divide(above, above - below, out=np.zeros_like(above), where=through)
        crosses |= through & _inside(p + t[:, None] * (q - p), a, b, c, normal, size)
    return crosses


def _inside(x: F64, a: F64, b: F64, c: F64, normal: F64, size: F64) -> B1:
    """Return whether points in the planes of triangles lie within them."""
    within = size > 0
    for p, q in ((a, b), (b, c), (c, a)):
        side = np.einsum("pa,pa->p", np.cross(q - p, x - p), normal)
        within = within & (side >= 0)
    return np.asarray(within)
