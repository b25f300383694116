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
    that both their faces run through in the same direction; `inverted` says that a closed mesh has a
    negative volume.
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
    keys, counts, runs = _edges(f, len(v))
    return Defects(
        joinable=int(joinable_vertices(v, f).sum()),
        collapsed=int(collapsed_faces(f).sum()),
        repeated=int(repeated_faces(f).sum()),
        unreferenced=len(v) - len(np.unique(f)),
        zero_area=int((flat_faces(v, f) & ~collapsed_faces(f)).sum()),
        nonmanifold_edges=int((counts > 2).sum()),
        nonmanifold_vertices=int(nonmanifold_vertices(f, len(v)).sum()),
        flipped=int(((counts == 2) & (np.abs(runs) == 2)).sum()),
        inverted=bool((counts == 2).all() and not (runs != 0).any() and volume(v, f) < 0),
    )


def _edges(f: I64, n: int) -> tuple[I64, I64, I64]:
    """Return undirected edges as keys, how many faces each has, and forward minus backward runs."""
    f = f[~collapsed_faces(f)]
    a, b = f[:, [0, 1, 2]].ravel(), f[:, [1, 2, 0]].ravel()
    keys = np.minimum(a, b) * np.int64(n) + np.maximum(a, b)
    unique, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    runs = np.bincount(inverse.ravel(), weights=np.where(a < b, 1.0, -1.0), minlength=len(unique))
    return unique, counts, runs.astype(np.int64)


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
    exactly on another face. Two solids that touch, in a point or a side, are no reason to join them.
    """
    place = places(v)
    found = np.zeros(len(v), dtype=bool)
    if int(place.max()) + 1 == len(v):
        return found
    keys, counts, _ = _edges(f, len(v))
    open_edges = keys[counts == 1]
    candidates = np.zeros(len(v), dtype=bool)
    candidates[open_edges // len(v)] = True
    candidates[open_edges % len(v)] = True
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


def nonmanifold_vertices(f: I64, n: int) -> B1:
    """Return which vertices join several fans of faces, or lie on an edge of three faces, (n,).

    Two corners at a vertex are linked when their faces share an edge at it; the connected
    components of corners at a vertex are its fans.
    """
    f = f[~collapsed_faces(f)]
    m = len(f)
    corner = np.arange(3 * m).reshape(m, 3)
    a, b = f[:, [0, 1, 2]].ravel(), f[:, [1, 2, 0]].ravel()
    ca, cb = corner[:, [0, 1, 2]].ravel(), corner[:, [1, 2, 0]].ravel()
    low = np.where(a < b, ca, cb)
    high = np.where(a < b, cb, ca)
    keys = np.minimum(a, b) * np.int64(n) + np.maximum(a, b)
    order = np.argsort(keys, kind="stable")
    same = keys[order][1:] == keys[order][:-1]
    i, j = order[:-1][same], order[1:][same]
    rows, columns = np.concatenate([low[i], high[i]]), np.concatenate([low[j], high[j]])
    links = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(3 * m, 3 * m))
    fans, label = connected_components(links.tocsr(), directed=False)
    vertex_of_fan = np.zeros(fans, dtype=np.int64)
    vertex_of_fan[label] = f.ravel()
    bad: B1 = np.bincount(vertex_of_fan, minlength=n) > 1
    unique, counts = np.unique(keys, return_counts=True)
    crowded = unique[counts > 2]
    bad[crowded // n] = True
    bad[crowded % n] = True
    return bad
