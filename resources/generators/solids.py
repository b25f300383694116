"""Distance functions of simple solids and their smooth unions, all in millimetres.

Source: the well-known closed forms collected by I. Quilez, "distance functions".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Values = NDArray[np.float64]


def smooth_union(a: Values, b: Values, radius: float) -> Values:
    """Return min(a, b) with the crease filled by a fillet of about ``radius`` mm (C2)."""
    h = np.maximum(radius * 2 - np.abs(a - b), 0.0) / (radius * 2)
    return np.minimum(a, b) - h**3 * radius / 3.0


def smooth_cut(a: Values, b: Values, radius: float) -> Values:
    """Return a without b, the edge rounded by about ``radius`` mm."""
    return -smooth_union(-a, b, radius)


def box(p: Values, centre: ArrayLike, half: ArrayLike, rounding: float) -> Values:
    """Return the distance to a box with rounded edges; ``half`` includes the rounding."""
    q = np.abs(p - np.asarray(centre)) - (np.asarray(half) - rounding)
    outside = np.linalg.norm(np.maximum(q, 0.0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0.0) - rounding


def turned(
    along: Values, across: Values, start: float, end: float, r0: float, r1: float, rounding: float
) -> Values:
    """Return the distance to a truncated cone with rounded rims.

    ``along`` and ``across`` are the coordinates along and from the axis; the radius goes from
    ``r0`` at ``start`` to ``r1`` at ``end``.
    """
    half = 0.5 * (end - start) - rounding
    middle = 0.5 * (start + end)
    lean = (r1 - r0) / (end - start)
    cosine = 1.0 / np.hypot(1.0, lean)
    radius = 0.5 * (r0 + r1) + lean * (along - middle)
    side = (across - radius) * cosine + rounding
    flat = np.abs(along - middle) - half
    outside = np.hypot(np.maximum(side, 0.0), np.maximum(flat, 0.0))
    return outside + np.minimum(np.maximum(side, flat), 0.0) - rounding


def bump(distance: Values, power: float = 3.0) -> Values:
    """Return a round hill: 1 at distance 0, 0 from distance 1 on.

    Power 3 is smooth (C2) everywhere; power 2 is fuller and has a crisp outline (C1).
    """
    return np.maximum(1.0 - np.asarray(distance) ** 2, 0.0) ** power


def fade(x: Values, start: float, end: float) -> Values:
    """Return 0 before ``start``, 1 after ``end``, smooth (C2) between; start may exceed end."""
    t = np.clip((np.asarray(x) - start) / (end - start), 0.0, 1.0)
    return t**3 * (t * (6 * t - 15) + 10)
