"""Tips: where a curve turns so sharply that points spread evenly along it would cut it off."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from engine.arrays import F64, I64

# Looked at over three anchors to either side. A tip turns by so much there, and would lose so many
# pixels with the tremor: a bend that is followed anyway needs no care.
_ANCHORS = 3.0
_TURN = np.radians(20.0)
_LOST_PX = 0.6
# A curve that is as round everywhere has no tips.
_OF_MEAN = 1.5


def tips(calm: F64, drawn: F64, step: float, closed: bool = False) -> I64:
    """Return where a curve has tips, (t,) ascending indices of its points.

    Parameters
    ----------
    calm, drawn : (p, 2) px, at an even spacing of about 1 px: without tremor, to find them by; and
        as it was drawn, to place them at the furthest point from the chord below.
    step : px between two anchors.
    closed : whether the last point is followed by the first.
    """
    p = len(calm)
    reach = max(3, round(_ANCHORS * step))
    if p < 2 * reach + 3:
        return np.zeros(0, dtype=np.int64)
    i = np.arange(p) if closed else np.arange(reach, p - reach)
    before, after = calm[i] - calm[(i - reach) % p], calm[(i + reach) % p] - calm[i]
    across = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(across, (before * after).sum(axis=1)))
    highest = maximum_filter1d(turn, 2 * reach + 1, mode="wrap" if closed else "nearest")
    sharp = (turn == highest) & (turn > max(_TURN, _OF_MEAN * float(turn.mean())))
    found: I64 = i[sharp]
    if len(found) == 0:
        return found
    chord = calm[(found + reach) % p] - calm[(found - reach) % p]
    near = (found[:, None] + np.arange(-(reach // 2), reach // 2 + 1)) % p
    aside = drawn[near] - calm[(found - reach) % p, None]
    height = chord[:, None, 0] * aside[..., 1] - chord[:, None, 1] * aside[..., 0]
    height *= np.sign(height[:, [reach // 2]])
    furthest: I64 = near[np.arange(len(found)), np.argmax(height, axis=1)]
    lost = np.linalg.norm(drawn[furthest] - calm[furthest], axis=1)
    return np.unique(furthest[lost > _LOST_PX])


def drawn_to(at: F64, tip: F64, whole: float, closed: bool = False) -> F64:
    """Return lengths along a curve moved on so that the nearest one to each tip lies on it.

    What lies between two tips, or a tip and an end, moves evenly.

    Parameters
    ----------
    at : (c,) lengths where the curve is sampled, ascending, or a turned or reversed loop's.
    tip : (t,) lengths of the tips.
    whole : the curve's length.
    closed : whether the curve is a loop.
    """
    c = len(at)
    if len(tip) == 0 or c < 3:
        return at
    away = tip[:, None] - at[None]
    if closed:
        away -= whole * np.round(away / whole)
    else:
        away[:, [0, -1]] = np.inf
    nearest, which = np.unique(np.argmin(np.abs(away), axis=1), return_index=True)
    way = away[which, nearest]
    if closed:
        return np.asarray(at + np.interp(np.arange(c), nearest, way, period=c))
    knots = np.concatenate([[0], nearest, [c - 1]])
    return np.asarray(at + np.interp(np.arange(c), knots, np.concatenate([[0.0], way, [0.0]])))
