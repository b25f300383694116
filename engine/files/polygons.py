"""Polygons to triangles: quads by the better diagonal, larger ones by clipping ears."""

from __future__ import annotations

import numpy as np

from engine.arrays import B1, F64, I64

MANY = 64


def triangulate(vertices: F64, corners: I64, sizes: I64) -> I64:
    """Return triangles (f, 3) of polygons, in the polygons' order; concave ones do not fold over.

    Parameters
    ----------
    vertices : (n, 3).
    corners : (c,) vertex indices of all polygons, one after the other.
    sizes : (p,) number of corners of each polygon, at least 3.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3)
    starts = np.cumsum(sizes) - sizes
    first = np.cumsum(sizes - 2) - (sizes - 2)
    out = np.empty((int((sizes - 2).sum()), 3), dtype=np.int64)
    for k in np.unique(sizes):
        of_size = np.flatnonzero(sizes == k)
        rows = corners[starts[of_size, None] + np.arange(k)]
        if k == 3:
            out[first[of_size]] = rows
            continue
        flat = _flattened(vertices[rows])
        if k > MANY:
            pieces = np.stack([_clip_one(polygon) for polygon in flat])
        else:
            pieces = _clip_ears(flat, int(k))
        triangles = np.take_along_axis(rows[:, None, :], pieces, axis=2)
        out[(first[of_size, None] + np.arange(k - 2)).ravel()] = triangles.reshape(-1, 3)
    return out


def _flattened(points: F64) -> F64:
    """Return polygons (p, k, 3) in the plane of their Newell normal as (p, k, 2), anticlockwise."""
    centred = points - points.mean(axis=1, keepdims=True)
    scale = np.abs(centred).max(axis=(1, 2), keepdims=True)
    centred = np.divide(centred, scale, out=np.zeros_like(centred), where=scale > 0)
    normal = np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0, normal / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    across = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    u = np.cross(normal, across)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normal, u)
    return np.stack([np.einsum("pki,pi->pk", centred, u), np.einsum("pki,pi->pk", centred, v)], -1)


def _clip_ears(flat: F64, k: int) -> I64:
    """Return (p, k-2, 3) corner numbers; all polygons of one size are clipped side by side.

    At each round every polygon loses the ear with the best shape among those that are convex and
    hold no other corner; where rounding leaves none, the best-shaped corner of all.
    """
    p = len(flat)
    every = np.arange(p)
    left = np.tile(np.arange(k), (p, 1))
    out = np.empty((p, k - 2, 3), dtype=np.int64)
    scores = _ear_scores(flat, left)
    for ear in range(k - 2):
        m = left.shape[1]
        best = np.argmax(scores, axis=1)
        ring = (best[:, None] + np.array([-1, 0, 1])) % m
        out[:, ear] = np.take_along_axis(left, ring, axis=1)
        if m == 3:
            break
        keep = np.arange(m)[None, :] != best[:, None]
        left = left[keep].reshape(p, m - 1)
        scores = scores[keep].reshape(p, m - 1)
        for near in (best - 1, best):
            place = near % (m - 1)
            scores[every, place] = _scores_at(flat, left, place)
        # An ear that lost its only intruder becomes free: look again when none is left.
        stuck = scores.max(axis=1) <= 0
        if stuck.any() and m > 4:
            scores[stuck] = _ear_scores(flat[stuck], left[stuck])
    return out


def _clip_one(flat: F64) -> I64:
    """Return (k-2, 3) corner numbers of one polygon (k, 2) with many corners.

    Walks round and clips each ear it meets, every other corner first so that slivers stay few. Only
    reflex corners can lie in an ear, and a corner that was once convex stays so.
    """
    k = len(flat)
    after = np.roll(np.arange(k), -1).tolist()
    before = np.roll(np.arange(k), 1).tolist()
    turn = _cross(flat - np.roll(flat, 1, axis=0), np.roll(flat, -1, axis=0) - flat)
    reflex = turn <= 0
    left, at, refused = k, 0, 0
    out: list[tuple[int, int, int]] = []
    while left > 3:
        a, c = before[at], after[at]
        if refused > left or (not reflex[at] and _is_free(flat, reflex, a, at, c)):
            out.append((a, at, c))
            after[a], before[c] = c, a
            reflex[at] = False
            for b in (a, c):
                p, q, r = flat[before[b]], flat[b], flat[after[b]]
                reflex[b] &= float(_cross(q - p, r - q)) <= 0
            left, refused = left - 1, 0
            at = after[c]
        else:
            refused += 1
            at = c
    out.append((before[at], at, after[at]))
    return np.array(out, dtype=np.int64)


def _is_free(flat: F64, reflex: B1, a: int, b: int, c: int) -> bool:
    at = np.flatnonzero(reflex)
    at = at[(at != a) & (at != b) & (at != c)]
    return not _holds(flat[[a]], flat[[b]], flat[[c]], flat[None, at]).any()


def _ear_scores(flat: F64, left: I64) -> F64:
    m = left.shape[1]
    return np.stack(
        [_scores_at(flat, left, np.full(len(left), place)) for place in range(m)], axis=1
    )


def _scores_at(flat: F64, left: I64, place: I64) -> F64:
    """Return how good an ear each polygon's corner `place` is, (p,): above 0 for a true ear."""
    m = left.shape[1]
    ring = (place[:, None] + np.array([-1, 0, 1])) % m
    points = np.take_along_axis(flat, left[:, :, None], axis=1)
    a, b, c = (points[np.arange(len(left)), ring[:, i]] for i in range(3))
    area = _cross(b - a, c - b)
    longest = np.maximum.reduce([_square(b - a), _square(c - b), _square(a - c)])
    shape = np.divide(area, longest, out=np.full_like(area, -1.0), where=longest > 0)
    inside = _holds(a, b, c, points)
    inside[np.arange(len(left))[:, None], ring] = False
    blocked = inside.any(axis=1)
    return np.where(blocked & (shape > 0), shape - 2.0, np.where(shape > 0, shape, shape - 4.0))


def _holds(a: F64, b: F64, c: F64, points: F64) -> B1:
    """Return which points (p, m, 2) lie in or on the triangles a, b, c (p, 2)."""

    def side(s: F64, e: F64) -> F64:
        return _cross((e - s)[:, None, :], points - s[:, None, :])

    same = (
        (points == a[:, None]).all(-1)
        | (points == b[:, None]).all(-1)
        | (points == c[:, None]).all(-1)
    )
    return np.asarray((side(a, b) >= 0) & (side(b, c) >= 0) & (side(c, a) >= 0) & ~same)


def _cross(u: F64, v: F64) -> F64:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _square(u: F64) -> F64:
    return np.asarray((u * u).sum(axis=-1))
