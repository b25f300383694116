"""What is wrong with a triangle mesh: counted, not changed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from engine.arrays import B1, F64, I64


@dataclass(frozen=True)
class Defects:
    """Counts of each kind of defect.

    `joinable` counts vertices on open borders that lie exactly on another vertex; `flipped` edges
    that both their faces run through in the same direction; `inverted` says that a closed mesh has
    a negative volume.
    """

    joinable: int
    collapsed: int
    repeated: int
    unreferenced: int
    zero_area: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    flipped: int
    inverted: bool


def find_defects(v: F64, f: I64) -> Defects:
    """Return the defects of vertices (n, 3) and faces (f, 3)."""
    collapsed = collapsed_faces(f)
    edges = _Edges(f[~collapsed], len(v))
    closed = bool((edges.counts == 2).all() and (edges.runs == 0).all())
    return Defects(
        joinable=int(joinable_vertices(v, f).sum()),
        collapsed=int(collapsed.sum()),
        repeated=int(repeated_faces(f).sum()),
        unreferenced=int((np.bincount(f.ravel(), minlength=len(v)) == 0).sum()),
        zero_area=int((flat_faces(v, f) & ~collapsed).sum()),
        nonmanifold_edges=int((edges.counts > 2).sum()),
        nonmanifold_vertices=int(_nonmanifold(edges).sum()),
        flipped=int(((edges.counts == 2) & (np.abs(edges.runs) == 2)).sum()),
        inverted=closed and volume(v, f) < 0,
    )


class _Edges:
    """The undirected edges of faces (m, 3) that name three vertices each.

    Half-edge h of face h // 3 runs from corner h to the next corner. `order` puts the half-edges of
    an edge side by side; edge e has `counts[e]` of them from `starts[e]` on, and `runs[e]` is how
    many run from the smaller vertex to the larger one, less those that run back.
    """

    def __init__(self, f: I64, n: int) -> None:
        self.n = n
        self.tail = f.ravel()
        self.head = f[:, [1, 2, 0]].ravel()
        keys = np.minimum(self.tail, self.head) * np.int64(n) + np.maximum(self.tail, self.head)
        self.order = np.argsort(keys, kind="stable")
        in_order = keys[self.order]
        self.same = in_order[1:] == in_order[:-1]
        self.starts = np.flatnonzero(np.concatenate([[True], ~self.same]))[: len(keys)]
        self.keys = in_order[self.starts]
        self.counts = np.diff(np.append(self.starts, len(keys)))
        forward = np.cumsum(np.where(self.tail < self.head, 1, -1)[self.order], dtype=np.int64)
        last = np.append(self.starts[1:], len(keys))[: len(self.starts)] - 1
        self.runs = np.diff(forward[last], prepend=0)

    def ends(self, chosen: B1) -> B1:
        """Return which vertices are on the `chosen` edges, (n,)."""
        mask = np.zeros(self.n, dtype=bool)
        mask[self.keys[chosen] // self.n] = True
        mask[self.keys[chosen] % self.n] = True
        return mask


def collapsed_faces(f: I64) -> B1:
    """Return which faces name a vertex twice, (f,)."""
    return np.asarray((f[:, 0] == f[:, 1]) | (f[:, 1] == f[:, 2]) | (f[:, 2] == f[:, 0]))


def repeated_faces(f: I64) -> B1:
    """Return which faces have the same three vertices as an earlier one, (f,)."""
    low, middle, high = np.sort(f, axis=1).T
    order = np.lexsort((high, middle, low))
    same = np.diff(low[order]) == 0
    same &= np.diff(middle[order]) == 0
    same &= np.diff(high[order]) == 0
    again = np.zeros(len(f), dtype=bool)
    # lexsort is stable: of equal faces the first one stays.
    again[order[1:][same]] = True
    return again


def places(v: F64) -> I64:
    """Return a number for each vertex, (n,), equal for vertices at exactly the same place."""
    v = v + 0.0
    order = np.lexsort((v[:, 2], v[:, 1], v[:, 0]))
    new = (np.diff(v[order], axis=0) != 0).any(axis=1)
    place = np.empty(len(v), dtype=np.int64)
    place[order] = np.concatenate([[0], np.cumsum(new)])
    return place


def areas(v: F64, f: I64) -> F64:
    """Return the faces' areas, (f,), in mesh units squared."""
    a, b, c = (v[f[:, i]] for i in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def flat_faces(v: F64, f: I64) -> B1:
    """Return which faces have no area: a height below 1e-9 of their longest edge, (f,)."""
    a, b, c = (v[f[:, i]] for i in range(3))
    longest = np.maximum.reduce([np.abs(b - a).max(1), np.abs(c - b).max(1), np.abs(a - c).max(1)])
    scale = np.where(longest > 0, longest, 1.0)[:, None]
    twice = np.linalg.norm(np.cross((b - a) / scale, (c - a) / scale), axis=1)
    return np.asarray((longest == 0) | (twice <= 1e-9))


def volume(v: F64, f: I64) -> float:
    """Return the signed volume, about the mesh's middle so that an offset costs no digits."""
    low, high = v.min(axis=0), v.max(axis=0)
    size = float(np.max(high / 2 - low / 2)) or 1.0
    a, b, c = ((v[f[:, i]] - (low / 2 + high / 2)) / size for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def joinable_vertices(v: F64, f: I64) -> B1:
    """Return which vertices should be one with another at the same place, (n,).

    Those on an open border beside another such one, and those of a piece whose every face lies
    exactly on another face. Solids that touch, in a point or a side, are no reason to join them.
    """
    place = places(v)
    found = np.zeros(len(v), dtype=bool)
    if int(place.max()) + 1 == len(v):
        return found
    edges = _Edges(f[~collapsed_faces(f)], len(v))
    candidates = edges.ends(edges.counts == 1)
    at_place = np.bincount(place[candidates], minlength=len(v))
    found[candidates] = at_place[place[candidates]] > 1
    found[f[_in_doubled_pieces(f, place)].ravel()] = True
    return found


def _in_doubled_pieces(f: I64, place: I64) -> B1:
    """Return which faces belong to a piece that lies with every face on another one, (f,)."""
    low, middle, high = np.sort(place[f], axis=1).T
    keys = np.lexsort((high, middle, low))
    new = (np.diff(np.column_stack([low, middle, high])[keys], axis=0) != 0).any(axis=1)
    group = np.empty(len(f), dtype=np.int64)
    group[keys] = np.concatenate([[0], np.cumsum(new)])
    # A face that names the same vertices as another is a repeated face, not one of another piece.
    alone = (np.bincount(group[~repeated_faces(f)]) == 1)[group]
    n = len(place)
    ends = (np.concatenate([f[:, 0], f[:, 0]]), np.concatenate([f[:, 1], f[:, 2]]))
    links = sp.coo_array((np.ones(2 * len(f)), ends), shape=(n, n))
    piece = connected_components(links.tocsr(), directed=False)[1][f[:, 0]]
    with_lone = np.zeros(n, dtype=bool)
    with_lone[piece[alone]] = True
    return np.asarray(~with_lone[piece])


def _nonmanifold(edges: _Edges) -> B1:
    """Return which vertices join several fans of faces, or lie on an edge of three faces, (n,).

    Two corners at a vertex are linked when their faces share an edge at it; the connected
    components of corners at a vertex are its fans.
    """
    corners = np.arange(len(edges.tail))
    following = corners - corners % 3 + (corners + 1) % 3
    small = np.where(edges.tail < edges.head, corners, following)
    large = np.where(edges.tail < edges.head, following, corners)
    i, j = edges.order[:-1][edges.same], edges.order[1:][edges.same]
    ends = (np.concatenate([small[i], large[i]]), np.concatenate([small[j], large[j]]))
    links = sp.coo_array((np.ones(len(ends[0])), ends), shape=(len(corners), len(corners)))
    fans, label = connected_components(links.tocsr(), directed=False)
    vertex_of_fan = np.zeros(fans, dtype=np.int64)
    vertex_of_fan[label] = edges.tail
    several = np.bincount(vertex_of_fan, minlength=edges.n) > 1
    return np.asarray(several | edges.ends(edges.counts > 2))
