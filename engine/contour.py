"""The contour of a form: where it turns away from the eye, and how far it goes beyond a target.

Anchors on the outline of a form that meet their targets do not make the targets its new outline:
another part of the flank comes to lie outside them. The aim of such a stroke is the outline itself;
it is met by asking the anchors to stay so much further inside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64
from engine.mesh import Mesh
from engine.sketch import chord_lengths, source_curve, target_curve
from engine.view import View

if TYPE_CHECKING:
    from engine.edit import Stroke

# What lies further from the source than this share of its length belongs to other outlines.
_BESIDE = 0.5
# A new outline lies at most this share of the anchors' way, and so many pixels, off its target.
_OF_THE_WAY, _NEAR_PX = 0.5, 8.0
# Waves shorter than so many anchors are not followed; with few anchors, than a share of them.
_WAVE_ANCHORS, _WAVE_SHARE, _WAVE_LEAST = 10.0, 0.3, 5.0
_BETWEEN = 4  # places from one anchor to the next at which the outline is measured
_LAP = 8  # points beyond which a loop's spline forgets where it was cut
_KINK = np.radians(20.0)
_STILL_PX = 2.0  # a target this near to its anchors hardly asks for anything
_LEAST_COSINE = 0.3  # between the normals of an edge and of the target it crosses
_MOST_PAIRS = 4_000_000


@dataclass(frozen=True, eq=False)
class Contour:
    """The edges of a part of a surface and the two faces at each, to find its contour by.

    Parameters
    ----------
    faces : (f, 3) vertex ids.
    edges : (e, 2) vertex ids, inside the part only.
    counts : (e,) how many faces meet there.
    which : (3 f,) the edge of each face's side, or e for edges that do not count.
    beside : (e, 2) two vertices whose triangles meet at the edge.
    """

    faces: I64
    edges: I64
    counts: I64
    which: I64
    beside: I64

    @classmethod
    def of(cls, mesh: Mesh, ids: ArrayLike) -> Self:
        """Return the contour of the part of a mesh between the vertices `ids`."""
        inside = np.zeros(mesh.n, dtype=bool)
        inside[np.asarray(ids)] = True
        faces = mesh.faces[mesh.topology.faces_about(np.asarray(ids))]
        pairs = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        opposite = faces[:, [2, 0, 1]].ravel()
        key = pairs[:, 0] * np.int64(mesh.n) + pairs[:, 1]
        _, first, which, counts = np.unique(
            key, return_index=True, return_inverse=True, return_counts=True
        )
        edges = pairs[first]
        last = np.zeros(len(edges), dtype=np.int64)
        last[which] = opposite
        kept = inside[edges].all(axis=1)
        place = np.where(kept, np.cumsum(kept) - 1, kept.sum())
        beside = np.column_stack([opposite[first], last])
        return cls(faces, edges[kept], counts[kept], place[which], beside[kept])

    def outline(self, view: View, vertices: F64) -> B1:
        """Mask (e,) of the edges on the outline: one side faces the eye and the other does not.

        An edge with no other side is on the outline where it can be seen from its front. A
        triangle faces the eye when its corners are seen in the order of their orientation, which
        holds for parallel projections as for perspective ones.

        Parameters
        ----------
        vertices : (n, 3) where the mesh is now.
        """
        a, b, c = (view.project(vertices[corner]) for corner in self.faces.T)
        u, v = b - a, c - a
        front = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0
        e = len(self.edges)
        facing = np.bincount(self.which, weights=np.repeat(front, 3), minlength=e + 1)[:e]
        return np.asarray((facing > 0) & ((facing < self.counts) | (self.counts == 1)))

    def lines(self, view: View, vertices: F64) -> F64:
        """Return the edges on the outline as they are seen, (s, 2, 2) px."""
        ends = self.edges[self.outline(view, vertices)]
        return np.stack([view.project(vertices[end]) for end in ends.T], axis=1)


def reach_beyond(lines: F64, curve: F64, outward: F64, limit: F64) -> F64:
    """Return how far lines go beyond a curve along its normals, (c,) px; NaN where they do not.

    Parameters
    ----------
    lines : (s, 2, 2) px.
    curve, outward : (c, 2) px and unit normals.
    limit : (c,) px that count, on either side; of several crossings the outermost does.
    """
    return crossings(lines, curve, outward, limit)[0]


def crossings(lines: F64, curve: F64, outward: F64, limit: F64) -> tuple[F64, I64, F64]:
    """Return where lines cross the normals of a curve; of several crossings the outermost counts.

    Parameters
    ----------
    lines, curve, outward, limit : as in `reach_beyond`.

    Returns
    -------
    height : (c,) px along the normal, NaN where nothing crosses it.
    line : (c,) which line does, 0 where none.
    share : (c,) of the way from that line's first end to its second.
    """
    c = len(curve)
    height, line, at = np.full(c, np.nan), np.zeros(c, dtype=np.int64), np.zeros(c)
    if len(lines) == 0 or c == 0:
        return height, line, at
    low, high = lines.min(axis=1), lines.max(axis=1)
    most = float(limit.max())
    near = ((high >= curve.min(axis=0) - most) & (low <= curve.max(axis=0) + most)).all(axis=1)
    ids = np.flatnonzero(near)
    if len(ids) == 0:
        return height, line, at
    start, along = lines[ids, 0], lines[ids, 1] - lines[ids, 0]
    rows = max(1, _MOST_PAIRS // len(ids))
    for first in range(0, c, rows):
        part = np.arange(first, min(first + rows, c))
        to = start[None] - curve[part, None]
        n = outward[part, None]
        across = along[None, :, 0] * n[..., 1] - along[None, :, 1] * n[..., 0]
        parallel = np.abs(across) < 1e-12
        share = (n[..., 0] * to[..., 1] - n[..., 1] * to[..., 0]) / np.where(parallel, 1.0, across)
        away = (to * n).sum(axis=2) + share * (along[None] * n).sum(axis=2)
        met = ~parallel & (share >= 0) & (share <= 1) & (np.abs(away) <= limit[part, None])
        away = np.where(met, away, -np.inf)
        best = away.argmax(axis=1)
        row = np.arange(len(part))
        found = np.isfinite(away[row, best])
        height[part[found]] = away[row, best][found]
        line[part[found]] = ids[best[found]]
        at[part[found]] = share[row, best][found]
    return height, line, at


class OutlineAim:
    """What a stroke whose anchors lie on the outline asks of the outline itself.

    Where the target is hardly away from the anchors, the outline may keep its own distance from
    the smooth curve through them, so that a target on that curve moves nothing.

    Parameters
    ----------
    contour : of what can move beside the stroke, see `contour_beside`.
    mesh : the mesh.
    rest : (n, 3) the surface that the stroke deforms.
    stroke : anchors, view, target.
    amount : share of the way to the target.

    Attributes
    ----------
    places : how many there are at which the outline is measured.
    """

    def __init__(
        self, contour: Contour, mesh: Mesh, rest: F64, stroke: Stroke, amount: float
    ) -> None:
        view, closed = stroke.view, stroke.closed
        self.stroke = stroke
        self._amount = amount
        self._contour = contour
        chain = rest[stroke.anchors]
        here = view.project(chain)
        way = amount * (stroke.target - here)
        before = view.project(source_curve(chain, closed))
        aim = target_curve(chain, here + way, view, closed)
        sign = _outward_sign(mesh, rest, stroke, before)
        self._outward = sign * _normals(aim, closed)
        self._aim, own = between(aim, closed), between(before, closed)
        self._aim_outward = sign * _normals(self._aim, closed)
        far = between(np.linalg.norm(way, axis=1)[:, None], closed)[:, 0].clip(0.0)
        self._limit = _NEAR_PX + _OF_THE_WAY * far
        self._even = even_fit(len(chain), len(far), closed)
        lines = self._contour.lines(view, rest)
        near = np.full(len(own), _NEAR_PX)
        found = reach_beyond(lines, own, sign * _normals(own, closed), near)
        self.places = len(own)
        faded = 1.0 / (1.0 + (far / _STILL_PX) ** 2)
        self._own = faded * np.where(np.isfinite(found), found, 0.0)

    def beyond(self, level: F64) -> F64:
        """Return how far the outline of the deformed surface (n, 3) is beyond the target, (q,) px.

        There are several places from one anchor to the next; NaN where no outline is near.
        """
        lines = self._contour.lines(self.stroke.view, level)
        return reach_beyond(lines, self._aim, self._aim_outward, self._limit) - self._own

    def even(self, beyond: F64) -> F64:
        """Return the even part of that at the anchors, (c,) px: finer they cannot follow."""
        return np.asarray(self._even @ without_gaps(beyond))

    def slopes(self, level: F64, ways: F64, roi: I64) -> F64:
        """Return the rates at which `beyond` grows as the surface goes some ways, (q, b).

        Parameters
        ----------
        level : (n, 3) the deformed surface.
        ways : (b, m, 3) displacements of the region's vertices, each small.
        roi : (m,) their ids, ascending.

        Notes
        -----
        A crossing goes with its edge, and along it: by the edge's own way across it, over the
        cosine between the edge's normal and that of the target.
        """
        view = self.stroke.view
        edges = self._contour.edges[self._contour.outline(view, level)]
        ends = np.stack([view.project(level[end]) for end in edges.T], axis=1)
        height, line, share = crossings(ends, self._aim, self._aim_outward, self._limit)
        known = np.flatnonzero(np.isfinite(height))
        pair, n = edges[line[known]], self._aim_outward[known]
        part = np.stack([1.0 - share[known], share[known]], axis=1)
        place = np.minimum(np.searchsorted(roi, pair), len(roi) - 1)
        part_moving = np.where(roi[place] == pair, part, 0.0)
        way = (ways[:, place] * part_moving[..., None]).sum(axis=2)
        here = (level[pair] * part[..., None]).sum(axis=1)
        went = view.project((here + way).reshape(-1, 3)).reshape(*way.shape[:2], 2)
        went -= view.project(here)
        along = ends[line[known], 1] - ends[line[known], 0]
        side = np.column_stack([along[:, 1], -along[:, 0]])
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        cosine = (side * n).sum(axis=1)
        cosine = np.copysign(np.maximum(np.abs(cosine), _LEAST_COSINE), cosine)
        rate = np.full((len(ways), len(height)), np.nan)
        rate[:, known] = (went * side).sum(axis=2) / cosine
        return np.stack([without_gaps(r) for r in rate], axis=1)

    def inside(self, shift: F64) -> Stroke:
        """Return the stroke with its targets moved inwards by `shift` (c,) px."""
        held = shift if self.stroke.weights is None else shift * self.stroke.weights
        target = self.stroke.target - (held / self._amount)[:, None] * self._outward
        return replace(self.stroke, target=target)


def contour_beside(mesh: Mesh, roi: I64, rest: F64, anchors: I64) -> Contour:
    """Return the contour of what can move and is beside a source: within half its length.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) ids that can move.
    rest : (n, 3) the surface that the stroke deforms.
    anchors : (c,) ids of the stroke's anchors.
    """
    chain = rest[anchors]
    reach = _BESIDE * float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
    away = cKDTree(chain).query(rest[roi], distance_upper_bound=max(reach, 1e-300))[0]
    return Contour.of(mesh, np.union1d(roi[np.isfinite(away)], anchors))


def between(points: F64, closed: bool) -> F64:
    """Return a curve (c, d) with `_BETWEEN` times as many points, on a spline between them.

    A spline would swing beside a tip: it ends there, and another one begins.
    """
    c = len(points)
    if c < 3:
        return points
    lap = min(c, _LAP)
    around = np.vstack([points[-lap:], points, points[: lap + 1]]) if closed else points
    first = lap if closed else 0
    i = first + np.arange(_BETWEEN * c if closed else _BETWEEN * (c - 1) + 1) / _BETWEEN
    knots = np.arange(len(around), dtype=np.float64)
    lengths = chord_lengths(around) + 1e-9 * knots
    at = np.interp(i, knots, lengths)
    dense = np.empty((len(i), points.shape[1]))
    for start, end in pairwise([0, *_kinks(around), len(around) - 1]):
        part = (i >= start) & (i <= end)
        if part.any():
            piece = slice(start, end + 1)
            dense[part] = CubicSpline(lengths[piece], around[piece])(at[part])
    return dense


def _kinks(points: F64) -> list[int]:
    """Return the inner points where a polyline (c, d) turns, and does not beside them."""
    if points.shape[1] != 2:
        return []
    steps = np.diff(points, axis=0)
    across = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    turn = np.abs(np.arctan2(across, (steps[:-1] * steps[1:]).sum(axis=1)))
    beside = np.convolve(turn, [0.5, 0.0, 0.5], mode="same")
    return [int(i) for i in np.flatnonzero((turn > _KINK) & (turn > 2 * beside)) + 1]


def even_fit(c: int, q: int, closed: bool) -> F64:
    """Return the matrix (c, q) from values along a curve to the even ones at its anchors.

    They are what fits best when it is drawn straight from anchor to anchor, with a weight on
    second differences that leaves out waves that the anchors cannot follow.
    """
    at = np.arange(q) / _BETWEEN if q > c else np.arange(q, dtype=np.float64)
    apart = np.abs(at[:, None] - np.arange(c))
    if closed:
        apart = np.minimum(apart, c - apart)
    hat = np.maximum(1.0 - apart, 0.0)
    waves = np.clip(_WAVE_SHARE * c, _WAVE_LEAST, _WAVE_ANCHORS)
    weight = q / c * (2 * np.sin(np.pi / waves)) ** -4.0
    bend = np.eye(c) - (np.roll(np.eye(c), 1, axis=0) + np.roll(np.eye(c), -1, axis=0)) / 2
    bend *= -2.0
    if not closed:
        bend = bend[1:-1]
    return np.asarray(np.linalg.solve(hat.T @ hat + weight * bend.T @ bend, hat.T))


def without_gaps(values: F64) -> F64:
    """Return values (q,) along a curve with those that are not known, NaN, from their neighbours.

    Where less than half is known, nothing is: the values are 0.
    """
    known = np.flatnonzero(np.isfinite(values))
    if 2 * len(known) < len(values):
        return np.zeros(len(values))
    return np.asarray(np.interp(np.arange(len(values)), known, values[known]))


def _normals(curve: F64, closed: bool) -> F64:
    """Return unit normals of a curve (c, 2), all on its same side."""
    if closed:
        along = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    else:
        along = np.gradient(curve, axis=0)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    along = along / np.where(size > 0, size, 1.0)
    return np.column_stack([-along[:, 1], along[:, 0]])


def _outward_sign(mesh: Mesh, rest: F64, stroke: Stroke, curve: F64) -> float:
    """Return 1 where the normals of the curve point away from the surface beside it, else -1."""
    near = mesh.topology.incidence[stroke.anchors].indices
    beside = np.unique(mesh.faces[near])
    at = stroke.view.project(rest[beside])
    nearest = cKDTree(curve).query(at)[1]
    side = ((at - curve[nearest]) * _normals(curve, stroke.closed)[nearest]).sum()
    return 1.0 if side <= 0 else -1.0
