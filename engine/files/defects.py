"""What is wrong with a triangle mesh: counted, not changed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from engine.arrays import B1, F64, I64


@dataclass(frozen=True)
class Defects:
    """Counts of each kind of defect.

    `joinable` counts vertices that should be one with another at the same place; `flipped` edges
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
        joinable=_used(f, len(v)) - _used(joined(v, f), len(v)),
        collapsed=int(collapsed.sum()),
        repeated=int(doubled_faces(v, f).sum()),
        unreferenced=len(v) - _used(f, len(v)),
        zero_area=int((flat_faces(v, f) & ~collapsed).sum()),
        nonmanifold_edges=int((edges.counts > 2).sum()),
        nonmanifold_vertices=int(_nonmanifold(edges).sum()),
        flipped=int(((edges.counts == 2) & (np.abs(edges.runs) == 2)).sum()),
        inverted=closed and volume(v, f) < 0,
    )


def _used(f: I64, n: int) -> int:
    return int((np.bincount(f.ravel(), minlength=n) > 0).sum())


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
    # Adding zero turns -0.0 into 0.0: both are the same place.
    rows = np.ascontiguousarray(v + 0.0)
    keys = _mixed_bits(rows)
    order = np.argsort(keys)
    new = np.diff(keys[order]) != 0
    apart = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    if (apart & ~new).any():
        # Two places share a key (or are not finite): sort by the coordinates themselves.
        order = np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))
        new = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    place = np.empty(len(v), dtype=np.int64)
    place[order] = np.concatenate([np.zeros(1, np.int64), np.cumsum(new)])[: len(v)]
    return place


def _all_apart(v: F64) -> bool:
    """Return whether no two vertices are at the same place; now and then False where it is so."""
    keys = np.sort(_mixed_bits(np.ascontiguousarray(v + 0.0)))
    return not bool((keys[1:] == keys[:-1]).any())


def _mixed_bits(rows: F64) -> NDArray[np.uint64]:
    """Return one number for the three coordinates of each row, (n,): equal for equal rows."""
    mixed = np.zeros(len(rows), dtype=np.uint64)
    for column in rows.view(np.uint64).T:
        # The shifts bring the upper bits down, which alone differ in rounded numbers.
        mixed ^= column ^ (column >> np.uint64(32))
        mixed *= np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def areas(v: F64, f: I64) -> F64:
    """Return the faces' areas, (f,), in mesh units squared."""
    a, b, c = (v[f[:, i]] for i in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def flat_faces(v: F64, f: I64) -> B1:
    """Return which faces have no area: a height below 1e-9 of their longest edge, (f,)."""
    x, y, z = np.ascontiguousarray(v.T)
    a, b, c = np.ascontiguousarray(f.T)
    p = [axis[b] - axis[a] for axis in (x, y, z)]
    q = [axis[c] - axis[a] for axis in (x, y, z)]
    longest = np.maximum.reduce([np.abs(d) for d in (*p, *q)])
    scale = np.where(longest > 0, longest, 1.0)
    p, q = [d / scale for d in p], [d / scale for d in q]
    squared = sum((p[i] * q[j] - p[j] * q[i]) ** 2 for i, j in ((1, 2), (2, 0), (0, 1)))
    return np.asarray((longest == 0) | (squared <= 1e-18))


def volume(v: F64, f: I64) -> float:
    """Return the signed volume, about the mesh's middle so that an offset costs no digits."""
    low, high = v.min(axis=0), v.max(axis=0)
    size = float(np.max(high / 2 - low / 2)) or 1.0
    a, b, c = ((v[f[:, i]] - (low / 2 + high / 2)) / size for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def joined(v: F64, f: I64) -> I64:
    """Return faces (f, 3) that share vertices where they lie side by side but have not so far.

    Vertices at the same place become one (the first of them) where their faces then meet along an
    edge as exactly two. Surfaces that merely touch stay apart, and so does what was taken apart
    where three faces meet: else a cleaned file would change again at every opening.
    """
    if _all_apart(v):
        return f
    place = places(v)
    border = _Edges(f[~collapsed_faces(f)], len(v))
    candidate = border.ends(border.counts == 1)
    first = np.full(len(v), len(v))
    np.minimum.at(first, place[candidate], np.flatnonzero(candidate))
    stand_in = np.where(candidate, first[place], np.arange(len(v)))
    merged = stand_in[f]
    proper = ~collapsed_faces(merged)
    edges = _Edges(merged[proper], len(v))
    fan, fans = _fans(edges, np.asarray(edges.counts == 2))
    own = np.full(fans, len(v))
    np.minimum.at(own, fan, f[proper].ravel())
    faces = merged.copy()
    faces[proper] = own[fan].reshape(-1, 3)
    # A face between two vertices at one place closes up, where those are one vertex now.
    settled = np.full(len(v), len(v))
    np.minimum.at(settled, merged[proper].ravel(), faces[proper].ravel())
    faces[~proper] = np.where(settled < len(v), settled, np.arange(len(v)))[merged[~proper]]
    return faces


def doubled_faces(v: F64, f: I64) -> B1:
    """Return which faces repeat an earlier one, (f,): the same vertices, or a whole piece's places.

    A single face that lies on another may be the side of one solid that touches another solid; only
    where a piece lies with every face on other faces it is a copy.
    """
    again = repeated_faces(f)
    if _all_apart(v):
        return again
    place = places(v)
    return again | (repeated_faces(place[f]) & _in_doubled_pieces(f, place))


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
    """Return which vertices join several fans of faces, or lie on an edge of three faces, (n,)."""
    fan, fans = _fans(edges, np.ones(len(edges.counts), dtype=bool))
    vertex_of_fan = np.zeros(fans, dtype=np.int64)
    vertex_of_fan[fan] = edges.tail
    several = np.bincount(vertex_of_fan, minlength=edges.n) > 1
    return np.asarray(several | edges.ends(edges.counts > 2))


def fans_apart(f: I64, n: int) -> tuple[I64, I64]:
    """Return faces (f, 3) in which every fan has a vertex of its own, and whose copy each one is.

    Fans end at borders and at edges of three or more faces. The first fan at a vertex keeps it; the
    others get new ones from n on. The second result, (more,), names the vertex each is a copy of.
    Faces must name three vertices each.
    """
    edges = _Edges(f, n)
    fan, fans = _fans(edges, np.asarray(edges.counts == 2))
    first_corner = np.full(fans, len(fan))
    np.minimum.at(first_corner, fan, np.arange(len(fan)))
    vertex = edges.tail[first_corner]
    by_vertex = np.lexsort((first_corner, vertex))
    copy = np.zeros(fans, dtype=bool)
    copy[by_vertex[1:]] = vertex[by_vertex][1:] == vertex[by_vertex][:-1]
    own = vertex.copy()
    own[copy] = n + np.arange(int(copy.sum()))
    return own[fan].reshape(-1, 3), vertex[copy]


def _fans(edges: _Edges, linking: B1) -> tuple[I64, int]:
    """Return the fan of every face corner, (3 m,), and how many fans there are.

    Two corners at a vertex are linked when their faces share a `linking` edge at it; the connected
    components of corners are the fans.
    """
    corners = np.arange(len(edges.tail))
    following = corners - corners % 3 + (corners + 1) % 3
    small = np.where(edges.tail < edges.head, corners, following)
    large = np.where(edges.tail < edges.head, following, corners)
    linked = edges.same & np.repeat(linking, edges.counts)[1:]
    i, j = edges.order[:-1][linked], edges.order[1:][linked]
    ends = (np.concatenate([small[i], large[i]]), np.concatenate([small[j], large[j]]))
    links = sp.coo_array((np.ones(len(ends[0])), ends), shape=(len(corners), len(corners)))
    fans, label = connected_components(links.tocsr(), directed=False)
    return label.astype(np.int64), int(fans)
