"""The chain of vertices that stands for a source curve (Fig. 9).

A stroke crosses a strip of triangles. Between two neighbouring triangles of the strip lies one edge
that is crossed; picking one end of every crossed edge gives vertices that are the same or adjacent
from each edge to the next, because both edges belong to the triangle between them. So every choice
of sides is a connected chain with a vertex on every triangle of the strip, and the best choice is a
shortest path through a ladder with two nodes a rung.

Source: Orbay et al. 2012, Section 5.2.1, Fig. 9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64, distinct
from engine.errors import SketchError
from engine.mesh import Mesh
from engine.sketch import checked_path, tidy_stroke
from engine.view import View

_BRIDGE_RINGS = 3
_STAY = 1e-6
_LEAST_LOOP = 3  # anchors


@dataclass(frozen=True, eq=False)
class AnchorPath:
    """A chain of anchors and how much of the stroke it stands for.

    Parameters
    ----------
    anchors : (c,) vertex ids in the order of the stroke; each once, neighbours share an edge.
    coverage : share of the triangles under the stroke that have a vertex among the anchors.
    bridged : how many gaps of the stroke (background, hidden or missing triangles) were closed
        along the surface.
    parted : whether the stroke runs over parts that are not connected; the chain then lies where
        most of the stroke does.
    """

    anchors: I64
    coverage: float
    bridged: int
    parted: bool = False


def anchor_path(
    mesh: Mesh,
    faces: ArrayLike,
    path_px: ArrayLike,
    view: View,
    roi: ArrayLike | None = None,
    closed: bool = False,
) -> I64:
    """Return the anchors of a source curve, (c,); see `trace_anchors`."""
    return trace_anchors(mesh, faces, path_px, view, roi, closed).anchors


def trace_anchors(
    mesh: Mesh,
    faces: ArrayLike,
    path_px: ArrayLike,
    view: View,
    roi: ArrayLike | None = None,
    closed: bool = False,
) -> AnchorPath:
    """Find the shortest chain of edges along a stroke that touches every triangle under it.

    Parameters
    ----------
    mesh : the surface as it is shown.
    faces : (f,) ids of the visible faces under the stroke in its order, repeats allowed.
    path_px : (p, 2) the stroke, px in `view`.
    view : the camera.
    roi : vertex ids that the chain must keep to; faces with another corner are left out.
    closed : whether the stroke comes back to its start.

    Raises
    ------
    SketchError
        No triangle is under the stroke, a loop lies on surfaces that do not touch, or it is no
        larger than a triangle.
    """
    path = checked_path(path_px)
    allowed = _allowed_faces(mesh, roi)
    given = _checked_faces(mesh, faces)
    under = _without_returns(given[allowed[given]])
    if len(under) == 0:
        raise SketchError("The stroke does not touch the region. Draw it on the coloured surface.")
    if closed:
        under = np.append(under, under[0])
    kept = under
    found = _strip(mesh, under, allowed)
    if found is None and not closed:
        kept, path = _longest_part(mesh, under, allowed, path, view)
        found = _strip(mesh, kept, allowed)
    if found is None:
        raise SketchError(
            "The stroke runs over parts that are not connected inside the region. "
            "Draw it on one connected part."
        )
    strip, bridged = found
    seen = np.empty((mesh.n, 2))  # of the strip's corners only
    corners = np.unique(mesh.faces[strip])
    seen[corners] = view.project(mesh.vertices[corners])
    chain = _ladder_path(mesh, strip, seen, path, closed)
    if closed and len(chain) > 1 and chain[0] == chain[-1]:
        chain = chain[:-1]
    chain = without_loops(chain)
    if closed and len(chain) < _LEAST_LOOP:
        raise SketchError("The loop is smaller than the triangles of the form. Draw a larger one.")
    on_chain = np.zeros(mesh.n, dtype=bool)
    on_chain[chain] = True
    coverage = float(on_chain[mesh.faces[np.unique(under)]].any(axis=1).mean())
    return AnchorPath(chain, coverage, bridged, len(kept) < len(under))


def _allowed_faces(mesh: Mesh, roi: ArrayLike | None) -> B1:
    if roi is None:
        return np.ones(len(mesh.faces), dtype=bool)
    inside = np.zeros(mesh.n, dtype=bool)
    inside[np.asarray(roi)] = True
    near = mesh.topology.faces_about(np.asarray(roi))
    allowed = np.zeros(len(mesh.faces), dtype=bool)
    allowed[near] = inside[mesh.faces[near]].all(axis=1)
    return allowed


def _checked_faces(mesh: Mesh, faces: ArrayLike) -> I64:
    ids = np.asarray(faces)
    if ids.size == 0:
        return np.zeros(0, dtype=np.int64)
    if ids.ndim != 1 or ids.dtype.kind not in "iu":
        raise SketchError("The faces under the stroke must be a list of whole numbers.")
    if ids.min() < 0 or ids.max() >= len(mesh.faces):
        raise SketchError("The stroke lies on another mesh. Draw it again on this one.")
    return np.asarray(ids, dtype=np.int64)


def _without_returns(faces: I64) -> I64:
    """Drop repeats and the flicker A B A that sampling along an edge gives."""
    while True:
        keep = np.append(True, faces[1:] != faces[:-1]) if len(faces) else np.zeros(0, dtype=bool)
        faces = faces[keep]
        back = np.zeros(len(faces), dtype=bool)
        if len(faces) > 2:
            back[1:-1] = faces[2:] == faces[:-2]
            # Of two returns in a row (A B A B) only the first can be taken out at once.
            back[1:] &= ~back[:-1]
        if not back.any():
            return faces
        faces = faces[~back]


def _longest_part(mesh: Mesh, under: I64, allowed: B1, path: F64, view: View) -> tuple[I64, F64]:
    """Return the faces under a stroke on the connected part with most of it, and its path there."""
    pool = np.flatnonzero(allowed)
    label = connected_components(_dual_graph(mesh, pool), directed=False)[1]
    part = label[np.searchsorted(pool, under)]
    at = view.project(mesh.vertices[mesh.faces[under]].mean(axis=1))
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    inside = part[1:] == part[:-1]
    parts = int(part.max()) + 1
    length = np.bincount(part[1:][inside], steps[inside], parts)
    length = length + 1e-9 * np.bincount(part, minlength=parts)
    kept = part == int(length.argmax())
    even = tidy_stroke(path, spacing=1.0)
    ends = cKDTree(even).query(at[np.flatnonzero(kept)[[0, -1]]])[1]
    low, high = int(ends.min()), max(int(ends.max()), int(ends.min()) + 1)
    return _without_returns(under[kept]), even[low : min(high, len(even) - 1) + 1]


def _strip(mesh: Mesh, under: I64, allowed: B1) -> tuple[I64, int] | None:
    """Return faces of which each shares an edge with the next, through all of `under`.

    With them, how many gaps that takes to bridge; None where some lie on parts that do not touch.
    """
    shares = _shared_corners(mesh.faces[under[:-1]], mesh.faces[under[1:]]) >= 2
    gaps = np.flatnonzero(~shares)
    if len(gaps) == 0:
        return under, 0
    near = _near_faces(mesh, np.unique(under), allowed)
    bridges = _bridges(mesh, near, under[gaps], under[gaps + 1])
    if bridges is None:
        bridges = _bridges(mesh, np.flatnonzero(allowed), under[gaps], under[gaps + 1])
    if bridges is None:
        return None
    pieces = np.split(under, gaps + 1)
    woven = [pieces[0]]
    for bridge, piece in zip(bridges, pieces[1:], strict=True):
        woven += [bridge, piece]
    return _without_returns(np.concatenate(woven)), len(gaps)


def _shared_corners(a: I64, b: I64) -> I64:
    return np.asarray((a[:, :, None] == b[:, None, :]).sum(axis=(1, 2)), dtype=np.int64)


def _near_faces(mesh: Mesh, faces: I64, allowed: B1) -> I64:
    for _ in range(_BRIDGE_RINGS):
        faces = mesh.topology.faces_about(distinct(mesh.faces[faces], mesh.n))
    return faces[allowed[faces]]


def _bridges(mesh: Mesh, pool: I64, starts: I64, ends: I64) -> list[I64] | None:
    """Return the faces strictly between each start and end on the shortest way inside `pool`.

    Where triangles are smaller than pixels there are hundreds of gaps, each a few faces wide, so
    a way is first looked for nearby only.
    """
    graph = _dual_graph(mesh, pool)
    local = np.empty(len(mesh.faces), dtype=np.int64)
    local[pool] = np.arange(len(pool))
    middle = mesh.vertices[mesh.faces[starts]].mean(axis=1)
    across = np.linalg.norm(middle - mesh.vertices[mesh.faces[ends]].mean(axis=1), axis=1)
    step = float(np.median(graph.data)) if graph.nnz else 0.0
    bridges = []
    for start, end, apart in zip(local[starts], local[ends], across, strict=True):
        for reach in (4.0 * (apart + step), np.inf):
            distance, before = dijkstra(graph, indices=start, limit=reach, return_predecessors=True)
            if np.isfinite(distance[end]):
                break
        else:
            return None
        way = [int(before[end])]
        while way[-1] >= 0 and way[-1] != start:
            way.append(int(before[way[-1]]))
        bridges.append(pool[np.array(way[-2::-1], dtype=np.int64)])
    return bridges


def _dual_graph(mesh: Mesh, pool: I64) -> sp.csr_array:
    """Return the graph of the faces `pool` with the distance of centroids over shared edges.

    Each way is in it to and fro: scipy would turn an undirected graph round for every search.
    """
    faces = mesh.faces[pool]
    corners = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys = corners[:, 0] * np.int64(mesh.n) + corners[:, 1]
    owner = np.repeat(np.arange(len(pool)), 3)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    a, b = owner[order[same]], owner[order[same + 1]]
    centre = mesh.vertices[faces].mean(axis=1)
    length = np.linalg.norm(centre[a] - centre[b], axis=1)
    length += 1e-9 * (length.max(initial=0.0) + 1e-300)
    n = len(pool)
    ends = np.concatenate([a, b]), np.concatenate([b, a])
    return sp.csr_array(sp.coo_array((np.tile(length, 2), ends), shape=(n, n)))


def _ladder_path(mesh: Mesh, strip: I64, seen: F64, path: F64, closed: bool) -> I64:
    """Return the cheapest choice of one end of every crossed edge, with an end in both end faces.

    A step along an edge costs its length, more so away from the stroke. Either end is that corner
    of its face where the distance from the stroke's end and the way on cost least together; the
    nearest corner alone often makes a hook. A loop ends where it starts.
    """
    rungs = _crossed_edges(mesh.faces[strip])
    first, last = mesh.faces[strip[0]], mesh.faces[strip[-1]]
    if closed:
        at_start = seen[first] - path[0]
        first = last = first[[int(np.argmin(np.linalg.norm(at_start, axis=1)))]]
    # Layers of nodes: a start, the first face's corners, one rung a layer, the last face's, an end.
    layers = [first[:1], first, *rungs, last, last[:1]]
    sizes = np.array([len(layer) for layer in layers])
    nodes = np.concatenate(layers)
    offset = np.concatenate([[0], np.cumsum(sizes)])
    tail, head = _layer_links(sizes, offset)
    a, b = nodes[tail], nodes[head]
    length = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    away = _distance_to(path, seen[nodes])
    edge_px = _typical(np.linalg.norm(seen[a] - seen[b], axis=1)[a != b])
    off = (away / edge_px) ** 2
    cost = length / _typical(length[a != b]) * (1.0 + off[tail] + off[head]) + _STAY
    for link, corner, point in (
        (tail == 0, head, path[0]),
        (head == len(nodes) - 1, tail, path[0] if closed else path[-1]),
    ):
        apart = np.linalg.norm(seen[nodes[corner[link]]] - point, axis=1)
        cost[link] = (apart / edge_px) ** 2 + _STAY
    graph = sp.csr_array(sp.coo_array((cost, (tail, head)), shape=(len(nodes), len(nodes))))
    _, before = dijkstra(graph, indices=0, return_predecessors=True)
    way = [int(before[len(nodes) - 1])]
    while before[way[-1]] > 0:
        way.append(int(before[way[-1]]))
    chain = nodes[np.array(way[::-1])]
    return np.asarray(chain[np.append(True, chain[1:] != chain[:-1])], dtype=np.int64)


def _typical(lengths: F64) -> float:
    """Return the median of lengths, or 1 where there is none above 0."""
    return float(np.median(lengths)) or 1.0 if len(lengths) else 1.0


def _layer_links(sizes: I64, offset: I64) -> tuple[I64, I64]:
    """Return all links from each layer of nodes to the next, tails and heads."""
    pairs = sizes[:-1] * sizes[1:]
    layer = np.repeat(np.arange(len(pairs)), pairs)
    own = np.arange(len(layer)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    tail = offset[layer] + own // sizes[layer + 1]
    head = offset[layer + 1] + own % sizes[layer + 1]
    return tail, head


def _crossed_edges(faces: I64) -> I64:
    """Return the vertices that each face (f, 3) shares with the next, (f - 1, 2)."""
    a, b = faces[:-1], faces[1:]
    common = (a[:, :, None] == b[:, None, :]).any(axis=2)
    # Twin faces share all three corners; any two of them will do.
    rank = np.cumsum(common, axis=1)
    common &= rank <= 2
    return np.asarray(a[common].reshape(-1, 2), dtype=np.int64)


def _distance_to(path: F64, points: F64) -> F64:
    """Return the distance of points (q, 2) to the stroke, px, to within half a pixel."""
    return np.asarray(cKDTree(tidy_stroke(path, spacing=1.0)).query(points)[0])


def without_loops(chain: I64) -> I64:
    """Return the chain cut short wherever it comes back to a vertex."""
    last_at = {int(v): i for i, v in enumerate(chain)}
    kept, i = [], 0
    while i < len(chain):
        kept.append(int(chain[i]))
        i = last_at[int(chain[i])] + 1
    return np.array(kept, dtype=np.int64)
