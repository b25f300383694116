"""The outline of a form as a source curve: the edges between what faces the eye and what does not.

A triangle faces the eye when its corners are seen in the order of their orientation, which holds
for parallel projections as for perspective ones.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from engine.anchors import without_loops
from engine.arrays import B1, F64, I64
from engine.contour import Contour
from engine.mesh import Mesh
from engine.sketch import along, checked_path, chord_lengths, source_curve, tidy_stroke
from engine.view import View

_OFF_OUTLINE = 8.0  # an edge beside the outline costs as much as so many on it
_FEWEST = 6  # anchors of a chain that is worth smoothing
_STRAYS = 4.0  # edges that a smooth chain may stray from the curve
_SAMPLES = 9  # points of an outline edge that the stroke may be near to


def outline_edges(mesh: Mesh, view: View, roi: ArrayLike) -> tuple[I64, B1, I64]:
    """Return the edges inside a region and which of them lie on the outline.

    Parameters
    ----------
    mesh : the surface as it is shown.
    view : the camera.
    roi : ids of the region.

    Returns
    -------
    edges : (e, 2) vertex ids.
    outline : (e,) mask: one side faces the eye and the other does not, or there is no other side.
    beside : (e, 2) two vertices whose triangles meet at the edge; of these one can be seen where
        the edge can.
    """
    contour = Contour.of(mesh, roi)
    return contour.edges, contour.outline(view, mesh.vertices), contour.beside


def silhouette_chain(
    mesh: Mesh,
    path_px: ArrayLike,
    view: View,
    roi: ArrayLike,
    closed: bool = False,
    reach: float = 24.0,
    visible: ArrayLike | None = None,
    share: float = 0.7,
) -> I64 | None:
    """Return the chain of vertices along the outline near a stroke, (c,), or None.

    Parameters
    ----------
    mesh : the surface as it is shown.
    path_px : (p, 2) the stroke, px in `view`.
    view : the camera.
    roi : vertex ids that the chain must keep to.
    closed : whether the stroke comes back to its start.
    reach : px that the stroke may be away from the outline.
    visible : vertex ids that can be seen; None when nothing hides anything.
    share : of the stroke that must be so near to the outline.

    Notes
    -----
    A first chain is the shortest way over edges from the outline's vertex nearest to the stroke's
    start, past one nearest to its middle, to the one nearest to its end. Edges on the outline are
    cheap, so others are taken only to close gaps. On a round flank the outline of the triangles
    jumps to and fro in depth, which is not seen from the eye but would dent the surface: the
    chain returned is the shortest way along the smooth curve that the first one zigzags around.
    None when too little of the stroke is near an outline or no such way exists.

    Raises
    ------
    SketchError
        The stroke is shorter than a pixel or not finite.
    """
    path = tidy_stroke(checked_path(path_px), 2.0)
    ids = np.unique(np.asarray(roi))
    px, away = np.empty((mesh.n, 2)), np.empty(mesh.n)  # of what lies near the stroke only
    px[ids] = view.project(mesh.vertices[ids])
    # In a large region the stroke is near to few.
    beside = px[ids]
    low, high = path.min(axis=0) - 2 * reach, path.max(axis=0) + 2 * reach
    ids = ids[((beside >= low) & (beside <= high)).all(axis=1)]
    away[ids] = cKDTree(path).query(px[ids])[0]
    ids = ids[away[ids] <= 2 * reach]
    edges, outline, beside = outline_edges(mesh, view, ids)
    if visible is not None:
        seen = np.zeros(mesh.n, dtype=bool)
        seen[np.asarray(visible)] = True
        outline &= seen[edges].any(axis=1) | seen[beside].any(axis=1)
    if not outline.any() or _near_share(path, px[edges[outline]], reach) < share:
        return None
    length = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    cost = length * np.where(outline, 1.0, _OFF_OUTLINE)
    cost *= 1.0 + ((away[edges] / reach) ** 2).sum(axis=1)
    cost += 1e-9 * float(cost.max()) + 1e-300
    on_outline = np.unique(edges[outline])
    at = (0.0, 1 / 3, 2 / 3, 0.0) if closed else (0.0, 0.5, 1.0)
    points = path[[round(share * (len(path) - 1)) for share in at]]
    stops = on_outline[cKDTree(px[on_outline]).query(points)[1]]
    rough = _way(edges, cost, stops, closed)
    return None if rough is None else _calm(mesh, rough, np.asarray(roi), closed)


def _calm(mesh: Mesh, chain: I64, roi: I64, closed: bool) -> I64:
    """Return the shortest way along the smooth curve through a chain, without its zigzag."""
    x = mesh.vertices
    loop = np.append(chain, chain[0]) if closed else chain
    curve = source_curve(x[chain], closed)
    curve = np.vstack([curve, curve[:1]]) if closed else curve
    lengths = chord_lengths(curve)
    edge = float(np.linalg.norm(np.diff(x[loop], axis=0), axis=1).mean())
    if len(chain) < _FEWEST or not edge > 0 or not lengths[-1] > 0:
        return chain
    at = np.linspace(0.0, lengths[-1], int(np.ceil(4 * lengths[-1] / edge)) + 1)
    ids = np.union1d(roi, chain)
    away = np.full(mesh.n, np.inf)
    tree = cKDTree(along(curve, lengths, at))
    away[ids] = tree.query(x[ids], distance_upper_bound=_STRAYS * edge)[0] / edge
    away[chain] = np.minimum(away[chain], _STRAYS)  # where nothing else joins, the first chain does
    near = ids[np.isfinite(away[ids])]
    links = mesh.topology.adjacency[near]
    edges = np.column_stack([np.repeat(near, np.diff(links.indptr)), links.indices])
    edges = edges[(edges[:, 0] < edges[:, 1]) & np.isfinite(away[edges[:, 1]])]
    cost = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    cost = cost * (1.0 + (away[edges] ** 2).sum(axis=1)) + 1e-9 * edge
    third = len(chain) // 3
    stops = chain[[0, third, 2 * third, 0]] if closed else chain[[0, -1]]
    calm = _way(edges, cost, stops, closed)
    return chain if calm is None else calm


def _near_share(path: F64, ends: F64, reach: float) -> float:
    """Return the share of a stroke (p, 2) that is near edges with the ends (e, 2, 2), px."""
    at = np.linspace(0, 1, _SAMPLES)[:, None, None]
    samples = (ends[:, 0] + at * (ends[:, 1] - ends[:, 0])).reshape(-1, 2)
    away = cKDTree(samples).query(path)[0]
    return float((away <= reach).mean())


def _way(edges: I64, cost: F64, stops: I64, closed: bool) -> I64 | None:
    """Return the shortest way over edges past all stops in order, each vertex once, or None."""
    # Numbered anew: the search would go through a row for every vertex of the mesh.
    ids = np.unique(np.concatenate([edges.ravel(), stops]))
    ends, stops = np.searchsorted(ids, edges), np.searchsorted(ids, stops)
    graph = sp.csr_array(sp.coo_array((cost, tuple(ends.T)), shape=(len(ids), len(ids))))
    distance, before = dijkstra(graph, directed=False, indices=stops[:-1], return_predecessors=True)
    chain = [stops[:1]]
    for leg, end in enumerate(stops[1:]):
        if not np.isfinite(distance[leg, end]):
            return None
        way = [int(end)]
        while way[-1] != stops[leg]:
            way.append(int(before[leg, way[-1]]))
        chain.append(np.array(way[-2::-1], dtype=np.int64))
    whole = np.concatenate(chain)
    if closed and len(whole) > 1:
        whole = whole[:-1]
    whole = without_loops(whole)
    return ids[whole] if len(whole) > 1 else None
