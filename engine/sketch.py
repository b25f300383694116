"""From strokes to constraints: anchors along a source curve, targets along a target curve.

Source: Orbay et al. 2012, Section 5.2.1, Figs. 9, 10.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.linalg as sla
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from engine.arrays import F64, I64
from engine.errors import SketchError
from engine.tips import drawn_to, tips
from engine.view import View

# Shorter than this share of its length in space, a curve is seen end-on.
_END_ON = 0.02
# The zigzag of a path along mesh edges has shorter waves than this many anchors. Of a curve with
# few of them a share counts as zigzag: more would take its own bend, and make a ring smaller.
_ZIGZAG_ANCHORS = 12.0
_ZIGZAG_SHARE = 0.25
_ZIGZAG_LEAST = 2.0
# Tremor is smoothed over so many steps between anchors, but within these limits.
_TREMOR_STEPS = 1.65
_TREMOR_PX = (1.65, 13.0)
# A tip stands where the stroke has it, up to a pixel's tremor.
_TIP_PX = 1.0
_LEAST_WEIGHT = 0.1


def tidy_stroke(path_px: ArrayLike, spacing: float = 2.0, smoothing: float = 0.0) -> F64:
    """Return a stroke at even spacing, without repeated points and, if wanted, without tremor.

    Parameters
    ----------
    path_px : (p, 2) as it was drawn, px.
    spacing : px between the points returned.
    smoothing : standard deviation of the Gaussian along the stroke, px; the ends stay.

    Raises
    ------
    SketchError
        The stroke is shorter than one pixel, or a coordinate is not finite.
    """
    path = checked_path(path_px)
    s = chord_lengths(path)
    count = max(2, int(np.ceil(s[-1] / spacing)) + 1)
    even = along(path, s, np.linspace(0.0, s[-1], count))
    if smoothing <= 0 or count < 4:
        return even
    # The Whittaker smoother damps a wave of angular frequency w to 1 / (1 + weight w^4); weight =
    # sigma^4 / 4 has the half-power width of a Gaussian with that sigma.
    return smoothed(even, (smoothing / (s[-1] / (count - 1))) ** 4 / 4, closed=False)


def pressure_weights(path_px: ArrayLike, pressures: ArrayLike, anchors_px: ArrayLike) -> F64:
    """Return weights (c,) for anchors from the pressure of the pen along a source curve.

    The weight is the pressure at the nearest point of the stroke over the highest one, and at
    least a tenth, so that the ends of a stroke, where a pen is set down and lifted, still hold.

    Parameters
    ----------
    path_px, pressures : (p, 2) px and (p,) in 0..1 as they were drawn.
    anchors_px : (c, 2) where the anchors are seen in the same view.

    Raises
    ------
    SketchError
        There is not one pressure for each point, or the stroke is none.
    """
    path = np.asarray(path_px, dtype=np.float64)
    pressure = np.asarray(pressures, dtype=np.float64)
    if pressure.shape != (len(path),) or not np.isfinite(pressure).all():
        raise SketchError("Give one pressure for each point of the stroke.")
    nearest = cKDTree(path).query(np.asarray(anchors_px, dtype=np.float64))[1]
    highest = float(pressure.max())
    share = pressure[nearest] / highest if highest > 0 else np.ones(len(nearest))
    return np.asarray(np.clip(share, _LEAST_WEIGHT, 1.0))


def checked_path(path_px: ArrayLike) -> F64:
    """Return a stroke as (p, 2) without points that repeat the one before; p >= 2.

    Raises
    ------
    SketchError
        It holds what is no pixel position, or it is only a point.
    """
    path = np.asarray(path_px, dtype=np.float64)
    if path.ndim != 2 or path.shape[1] != 2 or not np.isfinite(path).all():
        raise SketchError("The stroke must be a list of finite x, y pixel positions.")
    if len(path):
        path = path[np.append(True, (np.diff(path, axis=0) != 0).any(axis=1))]
    if len(path) < 2 or chord_lengths(path)[-1] < 1.0:
        raise SketchError("The stroke is only a point. Press, draw along the form, and let go.")
    return path


def chord_lengths(points: F64) -> F64:
    """Return the length along the polyline (p, d) up to each point, (p,), starting with 0."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def along(points: F64, lengths: F64, at: F64) -> F64:
    """Return the points of a polyline (p, d) at the lengths `at` (q,), as (q, d)."""
    return np.column_stack([np.interp(at, lengths, column) for column in points.T])


def smoothed(points: F64, weight: float, closed: bool) -> F64:
    """Return the polyline (p, d) that minimises |y - points|^2 + weight |second differences|^2.

    Both ends of an open one stay where they are.
    """
    p = len(points)
    if p < 4:
        return points.copy()
    if closed:
        w = 2 * np.sin(np.pi * np.fft.rfftfreq(p))
        gain = 1.0 / (1.0 + weight * w**4)
        return np.asarray(np.fft.irfft(np.fft.rfft(points, axis=0) * gain[:, None], p, axis=0))
    bands = np.zeros((3, p))
    bands[0] = 1.0 + weight * np.concatenate([[1.0, 5.0], np.full(p - 4, 6.0), [5.0, 1.0]])
    bands[1, :-1] = weight * np.concatenate([[-2.0], np.full(p - 3, -4.0), [-2.0]])
    bands[2, :-2] = weight
    # The ends are known: their columns go to the right side.
    rhs = points.copy()
    rhs[1] -= bands[1, 0] * points[0]
    rhs[2] -= bands[2, 0] * points[0]
    rhs[-2] -= bands[1, -2] * points[-1]
    rhs[-3] -= bands[2, -3] * points[-1]
    inner = np.zeros((3, p - 2))
    inner[0] = bands[0, 1:-1]
    inner[1, :-1] = bands[1, 1:-2]
    inner[2, :-2] = bands[2, 1:-3]
    y = points.copy()
    y[1:-1] = sla.solveh_banded(inner, rhs[1:-1], lower=True)
    return y


def source_curve(points: F64, closed: bool = False) -> F64:
    """Return the smooth curve that a chain of anchors zigzags around.

    Parameters
    ----------
    points : (c, 3) positions of the anchors, in order.
    closed : whether the last one is followed by the first.

    Returns
    -------
    (c, 3), one point for each anchor; the ends of an open chain stay.
    """
    waves = np.clip(_ZIGZAG_SHARE * len(points), _ZIGZAG_LEAST, _ZIGZAG_ANCHORS)
    cut = 2 * np.sin(np.pi / waves)
    return smoothed(points, cut**-4, closed)


def resample_target(
    points: ArrayLike,
    path_px: ArrayLike,
    view: View,
    closed: bool = False,
    carry_zigzag: bool = True,
) -> F64:
    """Return where the anchors of a source curve shall project to, (c, 2) px (Fig. 10).

    The target curve is sampled at the normalised chord lengths that the source curve has on the
    viewing plane. The ends are matched to the nearer ends, so a stroke drawn backwards is the same
    stroke. Where the source is seen end-on its chord says nothing, and lengths in space take its
    place. A closed target is matched by the start and direction that move the points least.

    Parameters
    ----------
    points : (c, 3) anchors on the surface that is shown, in order.
    path_px : (p, 2) the target as drawn, px in `view`.
    view : the camera it was drawn in.
    closed : whether the source is a loop; the target is then closed too.
    carry_zigzag : see Notes; False is the paper's rule.

    Raises
    ------
    SketchError
        There are no anchors, or the target is none.

    Notes
    -----
    Departure: a chain of mesh vertices zigzags around the curve that was drawn, by up to half an
    edge. Putting the vertices themselves on a smooth target presses that zigzag flat and leaves a
    ripple in the surface along the curve, seen at once in a highlight; even a target drawn just
    over the source would leave it. So the smooth curve through the chain is put on the target
    instead, and each anchor keeps its own offset from that curve, turned with it. The target
    loses what is finer than the anchors lie apart. Its tips stay: evenly spread samples would cut
    them off by up to half a step, so the nearest sample is moved on to each.
    """
    x = np.asarray(points, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 3 or len(x) == 0:
        raise SketchError("The source curve has no anchors. Draw it on the region again.")
    path = checked_path(path_px)
    curve = source_curve(x, closed) if carry_zigzag else x
    seen = view.project(curve)
    if len(x) == 1:
        return path[-1:].copy()
    sharp = np.zeros(0, dtype=np.int64)
    if carry_zigzag:
        path, sharp = without_tremor(path, seen, closed)
    if closed:
        hit = _closed_samples(seen, curve, np.vstack([path, path[:1]]), sharp)
    else:
        hit = _open_samples(seen, curve, path, sharp)
    if not carry_zigzag:
        return hit
    return hit + turned_offsets(view.project(x) - seen, seen, hit, closed)


def target_curve(points: F64, target: F64, view: View, closed: bool = False) -> F64:
    """Return the curve that targets (c, 2) px were sampled from, without the anchors' zigzag.

    It is the inverse of `resample_target`, to second order in the zigzag.

    Parameters
    ----------
    points : (c, 3) the anchors where they were, in order.
    target : (c, 2) px in `view`.
    """
    seen = view.project(source_curve(points, closed))
    offsets = turned_offsets(
        view.project(points) - seen, seen, source_curve(target, closed), closed
    )
    return target - offsets


def without_tremor(path: F64, seen: F64, closed: bool) -> tuple[F64, I64]:
    """Return the target without what is finer than the anchors, and which points are tips.

    Sampled at the anchors the tremor of a hand would come out as a ripple in the surface. Tips are
    wanted: the curve is calmed between them.
    """
    if closed:
        path = np.vstack([path, path[:1]])
    step = float(np.median(np.linalg.norm(np.diff(seen, axis=0), axis=1)))
    sigma = float(np.clip(_TREMOR_STEPS * step, *_TREMOR_PX))
    drawn = tidy_stroke(path, spacing=1.0)
    if closed:
        drawn = drawn[:-1]
    calm = _calmed(drawn, sigma, closed)
    nearly = _calmed(drawn, _TIP_PX, closed)
    sharp = tips(calm, nearly, step, closed)
    if len(sharp) == 0:
        return calm, sharp
    first = int(sharp[0]) if closed else 0
    nearly = np.roll(nearly, -first, axis=0)
    if closed:
        nearly = np.vstack([nearly, nearly[:1]])
    ends = np.unique([0, *(sharp - first), len(nearly) - 1])
    pieces = [_calmed(nearly[a : b + 1], sigma, False)[:-1] for a, b in pairwise(ends)]
    if closed:
        return np.concatenate(pieces), sharp - first
    return np.concatenate([*pieces, nearly[-1:]]), sharp


def _calmed(points: F64, sigma: float, closed: bool) -> F64:
    """Return a curve (p, 2) at a spacing of 1 px without tremor; long bends keep their height.

    What one round of smoothing takes off is smoothed and put back: of a bend as long as six
    sigma one round would take a fiftieth, this takes a two-thousandth.
    """
    weight = sigma**4 / 4
    once = smoothed(points, weight, closed)
    return once + smoothed(points - once, weight, closed)


def normalised_lengths(seen: F64, curve: F64) -> F64:
    """Return the normalised chord lengths of a curve seen in a view, (c,), from 0 to 1.

    Parameters
    ----------
    seen, curve : (c, 2) px and (c, 3) mesh units.
    """
    s = chord_lengths(seen)
    in_space = chord_lengths(curve)
    # What the curve would measure in pixels if it lay in the viewing plane.
    steps = np.diff(s) / np.maximum(np.diff(in_space), 1e-300)
    across = float(steps.max(initial=0.0)) * in_space[-1]
    end_on = s[-1] < 1.0 or s[-1] < _END_ON * across
    used = in_space if end_on else s
    if used[-1] <= 0:
        return np.linspace(0.0, 1.0, len(seen))
    return np.asarray(used / used[-1])


def _open_samples(seen: F64, curve: F64, path: F64, sharp: I64) -> F64:
    straight = np.linalg.norm(path[[0, -1]] - seen[[0, -1]], axis=1).sum()
    crossed = np.linalg.norm(path[[-1, 0]] - seen[[0, -1]], axis=1).sum()
    if crossed < straight:
        path, sharp = path[::-1], len(path) - 1 - sharp[::-1]
    lengths = chord_lengths(path)
    at = normalised_lengths(seen, curve) * lengths[-1]
    return along(path, lengths, drawn_to(at, lengths[sharp], lengths[-1]))


def _closed_samples(seen: F64, curve: F64, loop: F64, sharp: I64) -> F64:
    ring, ring3 = np.vstack([seen, seen[:1]]), np.vstack([curve, curve[:1]])
    s = normalised_lengths(ring, ring3)[:-1]
    lengths = chord_lengths(loop)
    turns = 4 * len(seen)
    best, best_at, best_cost = loop, s * lengths[-1], np.inf
    for way in (loop, loop[::-1]):
        around = lengths if way is loop else lengths[-1] - lengths[::-1]
        for shift in np.arange(turns) / turns:
            at = np.mod(s + shift, 1.0) * lengths[-1]
            cost = float(((along(way, around, at) - seen) ** 2).sum())
            if cost < best_cost:
                best, best_at, best_cost = way, at, cost
    if best is not loop:
        lengths, sharp = lengths[-1] - lengths[::-1], len(loop) - 1 - sharp[::-1]
    at = drawn_to(best_at, lengths[sharp], lengths[-1], closed=True)
    return along(best, lengths, np.mod(at, lengths[-1]))


def turned_offsets(offsets: F64, seen: F64, hit: F64, closed: bool) -> F64:
    """Return the offsets (c, 2) turned by the angle between the curve seen and the one hit."""
    before, after = _directions(seen, closed), _directions(hit, closed)
    turn = after * before.conj()
    size = np.abs(turn)
    turn = np.where(size > 1e-12, turn / np.where(size > 0, size, 1.0), 1.0)
    moved = (offsets[:, 0] + 1j * offsets[:, 1]) * turn
    return np.column_stack([moved.real, moved.imag])


def _directions(points: F64, closed: bool) -> F64:
    z = points[:, 0] + 1j * points[:, 1]
    if closed:
        return np.asarray(np.roll(z, -1) - np.roll(z, 1))
    return np.asarray(np.gradient(z)) if len(z) > 1 else np.ones(1)
