"""Sets of vertices: grown, shrunk, smoothed at their border, turned inside out, seen through.

None of these changes its argument; all return ascending ids.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from engine.arrays import B1, I64, distinct
from engine.mesh import Mesh, Topology
from engine.view import View

# From the middle of an equilateral triangle to its corners, in edge lengths.
_TO_CORNER = 3**-0.5


def grown(topology: Topology, roi: I64, rings: int = 1) -> I64:
    """Return the ids, ascending, of the region `roi` with `rings` rings of neighbours."""
    inside = _mask(topology, roi)
    for _ in range(rings):
        inside[_border(topology, inside, ~inside)] = True
    return np.flatnonzero(inside)


def shrunk(topology: Topology, roi: I64, rings: int = 1) -> I64:
    """Return the ids of the region without what lies within `rings` edges of its border.

    None may be left. An open border of the mesh is no border of the region.
    """
    outside = ~_mask(topology, roi)
    for _ in range(rings):
        outside[_border(topology, outside, ~outside)] = True
    return np.flatnonzero(~outside)


def inverted(topology: Topology, roi: I64) -> I64:
    """Return all other vertices of the connected parts of the mesh that the region touches.

    Other parts stay out: who circles a knob and inverts means the rest of its housing, not the
    screws beside it.
    """
    parts = topology.components
    touched = np.zeros(int(parts.max(initial=0)) + 1, dtype=bool)
    touched[parts[roi]] = True
    return np.flatnonzero(touched[parts] & topology.used_vertices & ~_mask(topology, roi))


def smoothed_border(topology: Topology, roi: I64, rounds: int = 3) -> I64:
    """Return the region with teeth and bays of its border taken away.

    The share of a vertex that lies inside is averaged over its neighbours `rounds` times; what is
    above one half afterwards is inside. Far from the border nothing changes.
    """
    inside = _mask(topology, roi)
    near = _about_border(topology, inside, rounds)
    weight, links = inside.astype(np.float64), topology.adjacency[near]
    degree = np.maximum(np.diff(links.indptr), 1)
    for _ in range(rounds):
        weight[near] = (weight[near] + np.asarray(links @ weight) / degree) / 2
    share = weight[near]
    inside[near] = np.where(share == 0.5, inside[near], share > 0.5)
    return np.flatnonzero(inside)


def _border(topology: Topology, one: B1, other: B1) -> I64:
    """Return the vertices of `other` beside those of `one`, one by one or again and again."""
    if np.count_nonzero(one) < np.count_nonzero(other):
        there = topology.adjacency[np.flatnonzero(one)].indices
        return np.asarray(there[other[there]], dtype=np.int64)
    ids = np.flatnonzero(other)
    links = topology.adjacency[ids]
    return np.asarray(np.repeat(ids, np.diff(links.indptr))[one[links.indices]], dtype=np.int64)


def _about_border(topology: Topology, inside: B1, rings: int) -> I64:
    """Return the vertices within so many edges of those at the border, on both of its sides."""
    few = np.flatnonzero(inside if 2 * np.count_nonzero(inside) <= len(inside) else ~inside)
    links = topology.adjacency[few]
    apart = inside[np.repeat(few, np.diff(links.indptr))] != inside[links.indices]
    near = np.zeros(len(inside), dtype=bool)
    front = distinct(links.indices[apart], topology.n)
    for _ in range(rings + 1):
        near[front] = True
        around = distinct(topology.adjacency[front].indices, topology.n)
        front = around[~near[around]]
    return np.flatnonzero(near)


def without_specks(topology: Topology, roi: I64, share: float) -> I64:
    """Return the region with the specks that it leaves out all around.

    Parameters
    ----------
    topology : of the mesh.
    roi : ids of the region, ascending.
    share : what is cut off from the rest of the mesh by the region, and has at most this share of
        its vertices, is a speck.
    """
    limit = share * len(roi)
    outside = topology.used_vertices & ~_mask(topology, roi)
    large = np.zeros_like(outside)  # known to hang together with more than the limit
    taken = [roi]
    # From the rim outwards ring by ring, so that the rest of a large mesh is never looked at.
    near = distinct(topology.adjacency[roi].indices, topology.n)
    near = near[outside[near]]
    while len(near):
        rows = topology.adjacency[near]
        own, other = np.repeat(np.arange(len(near)), np.diff(rows.indptr)), rows.indices
        place = np.minimum(np.searchsorted(near, other), len(near) - 1)
        inner = near[place] == other
        links = (np.ones(inner.sum(), dtype=bool), (own[inner], place[inner]))
        count, parts = connected_components(sp.coo_array(links, shape=(len(near),) * 2), False)
        further = outside[other] & ~inner
        grows = np.bincount(parts[own[further]], minlength=count) > 0
        beyond = np.bincount(parts[own[large[other]]], minlength=count) > 0
        beyond |= np.bincount(parts, minlength=count) > limit
        large[near[beyond[parts]]] = True
        taken.append(near[(~beyond & ~grows)[parts]])
        open_ones = (~beyond & grows)[parts]
        going_on = near[open_ones], other[further & open_ones[own]]
        near = distinct(np.concatenate(going_on), topology.n)
    return distinct(np.concatenate(taken), topology.n)


def seen_through(mesh: Mesh, roi: I64, view: View) -> I64:
    """Return the region with all that lies behind or before it in a view.

    A vertex is taken when the region's triangles cover it: when it is seen no farther from the
    region's nearest vertex than the middle of an even triangle lies from its corners.
    """
    pixels = view.project(mesh.vertices)
    region = pixels[roi]
    inner = sp.coo_array(mesh.topology.adjacency[roi][:, roi])
    apart = np.linalg.norm(region[inner.row] - region[inner.col], axis=1)
    reach = np.zeros(len(roi))
    np.maximum.at(reach, inner.row, apart)
    farthest = float(reach.max(initial=0.0))
    low, high = region.min(axis=0) - farthest, region.max(axis=0) + farthest
    near = ((pixels >= low) & (pixels <= high)).all(axis=1) & (view.depth(mesh.vertices) > 0)
    near &= mesh.topology.used_vertices
    ids = np.flatnonzero(near)
    away, nearest = cKDTree(region).query(pixels[ids])
    there = ids[away <= _TO_CORNER * reach[nearest]]
    return distinct(np.concatenate([roi, there]), mesh.n)


def connected_to(topology: Topology, ids: I64, vertex: int) -> I64:
    """Return those of `ids` that `vertex`, one of them, reaches along edges between them."""
    where = np.flatnonzero(ids == vertex)
    if len(where) == 0:
        return np.zeros(0, dtype=np.int64)
    inner = sp.csr_array(topology.adjacency[ids][:, ids])
    part = connected_components(inner, directed=False)[1]
    return np.asarray(ids[part == part[where[0]]])


def _mask(topology: Topology, roi: I64) -> B1:
    mask = np.zeros(topology.n, dtype=bool)
    mask[roi] = True
    return mask
