"""Closest points on a surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64
from engine.mesh import Mesh

_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class Closest:
    """Where on a surface points are closest to.

    Parameters
    ----------
    points : (q, 3) on the surface.
    faces : (q,) the triangle that each lies on.
    distances : (q,) to the points asked for.
    """

    points: F64
    faces: I64
    distances: F64


def closest_points(
    mesh: Mesh,
    points: F64,
    normals: F64 | None = None,
    within: B1 | None = None,
    neighbours: int = 5,
) -> Closest:
    """Return the points of a surface closest to given ones.

    Looked at are the triangles around the `neighbours` vertices closest to each point, which
    are the right ones unless triangles are very long; then the point is still one of the surface,
    though there may be a closer one.

    Parameters
    ----------
    mesh : the surface.
    points : (q, 3), mesh units.
    normals : (q, 3) keep to triangles that face the same way, where there are any nearby: on a thin
        wall the other side may be closer, but it is not meant.
    within : (f,) mask of the triangles to look at; None for all.
    neighbours : how many vertices to look around.
    """
    return Nearby(mesh, within).to(points, normals, neighbours)


class Nearby:
    """Finds the points of one surface that are closest to given ones, as often as asked.

    Parameters
    ----------
    mesh : the surface.
    within : (f,) mask of the triangles to look at; None for all.
    """

    def __init__(self, mesh: Mesh, within: B1 | None = None) -> None:
        faces = np.flatnonzero(np.ones(len(mesh.faces), dtype=bool) if within is None else within)
        corners = mesh.faces[faces].ravel()
        order = np.argsort(corners, kind="stable")
        many = np.bincount(corners, minlength=mesh.n)
        ids = np.flatnonzero(many)
        self._mesh = mesh
        self._around = faces[order // 3]
        self._counts = many[ids]
        self._starts = np.cumsum(self._counts) - self._counts
        self._tree = cKDTree(mesh.vertices[ids])

    def to(
        self,
        points: F64,
        normals: F64 | None = None,
        neighbours: int = 5,
        tick: Callable[[float], None] = lambda _share: None,
    ) -> Closest:
        """Return what `closest_points` does.

        Parameters
        ----------
        tick : called often with the share that is done.
        """
        mesh, f = self._mesh, len(self._mesh.faces)
        k = min(neighbours, self._tree.n)
        found = [Closest(np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0))]
        for first in range(0, len(points), _CHUNK):
            tick(first / len(points))
            part = slice(first, first + _CHUNK)
            near = self._tree.query(points[part], k=k)[1].reshape(len(points[part]), k)
            pairs = np.sort(_pairs(near, self._starts, self._counts, self._around, f))
            pairs = pairs[np.diff(pairs, prepend=-1) > 0]
            facing = None if normals is None else normals[part]
            found.append(_best(mesh, points[part], facing, pairs // f, pairs % f))
        return Closest(
            np.concatenate([one.points for one in found]),
            np.concatenate([one.faces for one in found]),
            np.concatenate([one.distances for one in found]),
        )


def _pairs(near: I64, starts: I64, counts: I64, around: I64, f: int) -> I64:
    """Return query * f + face for every query and the faces around its near vertices (q, k)."""
    query = np.repeat(np.arange(len(near)), near.shape[1])
    vertex = near.ravel()
    many = counts[vertex]
    begin = np.cumsum(many) - many
    within = np.arange(int(many.sum())) - np.repeat(begin, many)
    face = around[np.repeat(starts[vertex], many) + within]
    return np.asarray(np.repeat(query, many) * np.int64(f) + face)


def _best(mesh: Mesh, points: F64, normals: F64 | None, query: I64, face: I64) -> Closest:
    a, b, c = (mesh.vertices[mesh.faces[face, i]] for i in range(3))
    on = closest_on_triangles(points[query], a, b, c)
    away = on - points[query]
    squared = _dot(away, away)
    measure = squared
    if normals is not None:
        wrong = _dot(mesh.face_normals[face], normals[query]) <= 0
        measure = squared + np.where(wrong, 1.0 + float(squared.max(initial=0.0)), 0.0)
    starts = np.flatnonzero(np.diff(query, prepend=-1))
    least = np.repeat(np.minimum.reduceat(measure, starts), np.diff(np.append(starts, len(query))))
    hits = np.flatnonzero(measure == least)
    first = hits[np.diff(query[hits], prepend=-1) > 0]
    return Closest(on[first], face[first], np.sqrt(squared[first]))


def closest_on_triangles(p: F64, a: F64, b: F64, c: F64) -> F64:
    """Return the point of triangle i closest to point i, all (q, 3).

    Source: Ericson 2005, "Real-time collision detection", section 5.1.5.
    """
    ab, ac = b - a, c - a
    d1, d2 = _dot(ab, p - a), _dot(ac, p - a)
    d3, d4 = _dot(ab, p - b), _dot(ac, p - b)
    d5, d6 = _dot(ab, p - c), _dot(ac, p - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    total = va + vb + vc
    v, w = _ratio(vb, total), _ratio(vc, total)
    for where, share_b, share_c in (
        # Later lines override earlier ones: edges before corners.
        ((va <= 0) & (d4 >= d3) & (d5 >= d6), None, _ratio(d4 - d3, (d4 - d3) + (d5 - d6))),
        ((vb <= 0) & (d2 >= 0) & (d6 <= 0), np.zeros_like(d2), _ratio(d2, d2 - d6)),
        ((vc <= 0) & (d1 >= 0) & (d3 <= 0), _ratio(d1, d1 - d3), np.zeros_like(d1)),
        ((d6 >= 0) & (d5 <= d6), np.zeros_like(d1), np.ones_like(d1)),
        ((d3 >= 0) & (d4 <= d3), np.ones_like(d1), np.zeros_like(d1)),
        ((d1 <= 0) & (d2 <= 0), np.zeros_like(d1), np.zeros_like(d1)),
    ):
        of_b = 1.0 - share_c if share_b is None else share_b
        v, w = np.where(where, of_b, v), np.where(where, share_c, w)
    return np.asarray(a + v[:, None] * ab + w[:, None] * ac)


def _dot(u: F64, v: F64) -> F64:
    # Along an axis of three numpy sums several times slower.
    return np.asarray(np.einsum("qc,qc->q", u, v))


def _ratio(part: F64, whole: F64) -> F64:
    return np.divide(part, whole, out=np.zeros_like(part), where=whole != 0)
