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
    _, first = np.unique(np.sort(f, axis=1), axis=0, return_index=True)
    again = np.ones(len(f), dtype=bool)
    again[first] = False
    return again


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
    """Return which vertices on an open border lie exactly on another such vertex, (n,)."""
    keys, counts, _ = _edges(f, len(v))
    border = np.zeros(len(v), dtype=bool)
    open_edges = keys[counts == 1]
    border[open_edges // len(v)] = True
    border[open_edges % len(v)] = True
    found = np.zeros(len(v), dtype=bool)
    at = np.flatnonzero(border)
    if len(at):
        _, inverse, many = np.unique(v[at] + 0.0, axis=0, return_inverse=True, return_counts=True)
        found[at] = many[inverse.ravel()] > 1
    return found


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
