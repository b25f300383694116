"""Taking hold of a drawn curve: the part under the pointer follows, its neighbours less."""

from __future__ import annotations

import numpy as np

from plugins.api import F64

GRAB = 14.0  # px: a press this near to a curve takes hold of it
SHORTEST = 12.0  # px: a shorter path is a slip of the hand, not a curve


def lengths(curve: F64) -> F64:
    """Arc length from the first point to each point of a curve (c, 2), (c,) px."""
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def falloff(curve: F64, anchor: int, reach: float, closed: bool) -> F64:
    """Share (c,) of a drag that each point takes: 1 at the grasp, falling to 0 at `reach`."""
    s = lengths(curve)
    length = s[-1]
    away = np.abs(s - s[anchor])
    if closed:
        length = length + float(np.linalg.norm(curve[-1] - curve[0]))
        away = np.minimum(away, length - away)
    fraction = np.clip(away / max(reach * length, 1e-9), 0.0, 1.0)
    return np.asarray((1.0 - fraction**2) ** 2)


def extent(path: F64) -> float:
    """Return the longer side of the bounding box of a path (p, 2), px."""
    return float(np.ptp(path, axis=0).max())
