"""Redraw a part of a target: the stroke takes the place of what it runs beside.

Source: oversketching is usual where curves are drawn by hand; the rest is as in Orbay et al. 2012,
Section 5.2.1, Fig. 10.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from engine.arrays import F64, I64
from engine.sketch import (
    along,
    checked_path,
    chord_lengths,
    smoothed,
    source_curve,
    target_curve,
    turned_offsets,
    without_tremor,
)
from engine.tips import drawn_to
from engine.view import View

_EASE = 60.0  # px of a stroke in which it leaves or meets the curve, if it lies beside it there
# An end of a stroke this near to the curve lies on it; from the second on it leads away from it.
_MEETS, _PARTS = 20.0, 32.0
_CORNER = 30.0  # px to either side of a joint in which its corner is rounded
# Where a curve comes near itself, a stroke ends on the pass that is about its own length away: a
# px more or less of length counts as so many px of distance. Below 1 an end on the curve is exact.
_OF_LENGTH = 0.2


def redraw_part(
    points: ArrayLike,
    target: ArrayLike,
    path_px: ArrayLike,
    view: View,
    start: int,
    forward: bool,
    closed: bool = False,
    reach: float = 0.3,
) -> F64:
    """Return a target with a part of it drawn anew, (c, 2) px.

    The part begins at an anchor and ends where the curve is nearest to the end of the stroke. Its
    anchors keep their shares of the length. Where the stroke does not end near the curve, what
    comes behind goes along, less and less.

    Parameters
    ----------
    points : (c, 3) anchors on the surface that is shown, in order.
    target : (c, 2) where they shall project to as yet, px in `view`.
    path_px : (p, 2) the stroke, px; it begins near `target[start]`.
    view : the camera it was drawn in.
    start : the anchor where the part begins.
    forward : whether the stroke runs towards the anchors that come later, or the earlier ones.
    closed : whether the curve is a loop; the part may then run past its first anchor.
    reach : share of the length of the curve behind the part that goes along.

    Raises
    ------
    SketchError
        The stroke is only a point.
    """
    x = np.asarray(points, dtype=np.float64)
    seen = view.project(source_curve(x, closed))
    curve = target_curve(x, np.asarray(target, dtype=np.float64), view, closed)
    path, sharp = without_tremor(checked_path(path_px), seen, closed=False)
    ids = np.arange(len(curve)) if forward else np.arange(len(curve))[::-1]
    first = int(np.flatnonzero(ids == start)[0])
    ids = np.append(np.roll(ids, -first), start) if closed else ids[first:]
    anew = curve.copy()
    reach_px = reach * chord_lengths(curve)[-1]
    anew[ids], last = _replaced(curve[ids], path, sharp, reach_px, closed)
    for joint in (start, int(ids[last])):
        anew = _without_corner(anew, joint, closed)
    return anew + turned_offsets(view.project(x) - seen, seen, anew, closed)


def _replaced(ahead: F64, path: F64, sharp: I64, reach_px: float, closed: bool) -> tuple[F64, int]:
    """Put the first part of a curve (m, 2) on a path (p, 2); the next `reach_px` go along.

    The points `sharp` of the path are its tips, and stay. Returns the curve, and the last point of
    it that lies on the path.
    """
    if len(ahead) < 2:
        return ahead, 0
    a, t = chord_lengths(ahead), chord_lengths(path)
    ease = min(_EASE, t[-1] / 2)
    leaves = np.clip(1.0 - t / ease, 0.0, 1.0)[:, None]
    path = path + leaves**2 * (ahead[0] - path[0])
    away = np.linalg.norm(ahead - path[-1], axis=1)
    cost = away + _OF_LENGTH * np.abs(a - t[-1])
    last = 1 + int(cost[1:].argmin())
    meets = np.clip((_PARTS - away[last]) / (_PARTS - _MEETS), 0.0, 1.0)
    met = np.clip(1.0 - (t[-1] - t) / ease, 0.0, 1.0)[:, None]
    path = path + meets * met**2 * (ahead[last] - path[-1])
    t = chord_lengths(path)
    anew = ahead.copy()
    at = a[: last + 1] * (t[-1] / max(a[last], 1e-300))
    anew[: last + 1] = along(path, t, drawn_to(at, t[sharp], t[-1]))
    behind = a[last:] - a[last]
    fades = min(reach_px, behind[-1]) if closed else reach_px
    anew[last:] = ahead[last:] + _fading(behind, fades) * (path[-1] - ahead[last])
    return anew, last


def _without_corner(curve: F64, joint: int, closed: bool) -> F64:
    """Round a curve (c, 2) at a point where an old part meets a new one; ends stay."""
    if closed:
        middle = len(curve) // 2
        turned = np.roll(curve, middle - joint, axis=0)
        rounded = _without_corner(turned, middle, closed=False)
        return np.asarray(np.roll(rounded, joint - middle, axis=0))
    s = chord_lengths(curve)
    step = max(float(np.median(np.diff(s))), 1e-300)
    calm = smoothed(curve, (_CORNER / 2 / step) ** 4 / 4, closed=False)
    return np.asarray(curve + _fading(np.abs(s - s[joint]), _CORNER) * (calm - curve))


def _fading(away: F64, reach: float) -> F64:
    """Return shares (m, 1) that fall smoothly from 1 at distances (m,) of 0 to 0 at `reach`."""
    near = 1.0 - np.clip(away / max(reach, 1e-300), 0.0, 1.0) ** 2
    return np.asarray(near[:, None] ** 2)
