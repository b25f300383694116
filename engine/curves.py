"""A change along a chain of anchors, put on other vertices near the same curve."""

from __future__ import annotations

import numpy as np

from engine.arrays import F64


def positions_along(curve: F64, points: F64, closed: bool = False) -> F64:
    """Return where on a polyline the points nearest to `points` lie, (q,).

    Parameters
    ----------
    curve : (c, 3) its corners.
    points : (q, 3)
    closed : whether the last corner is followed by the first.

    Returns
    -------
    Corner numbers with fractions: 2.5 is half way from the third corner to the fourth.
    """
    if len(curve) == 1:
        return np.zeros(len(points))
    corners = np.vstack([curve, curve[:1]]) if closed else curve
    a, ab = corners[:-1], np.diff(corners, axis=0)
    size = np.maximum(np.einsum("pa,pa->p", ab, ab), 1e-300)
    t = np.clip((((points[:, None] - a) * ab).sum(axis=2)) / size, 0.0, 1.0)
    away = np.linalg.norm(points[:, None] - a - t[:, :, None] * ab, axis=2)
    nearest = away.argmin(axis=1)
    at = nearest + t[np.arange(len(points)), nearest]
    return np.asarray(np.where(at >= len(curve), at - len(curve), at) if closed else at)


def values_along(values: F64, at: F64, closed: bool = False) -> F64:
    """Return values (c, d) at the corners of a polyline interpolated at positions (q,), (q, d)."""
    corners = np.vstack([values, values[:1]]) if closed else values
    own = np.arange(len(corners))
    return np.column_stack([np.interp(at, own, column) for column in corners.T])
