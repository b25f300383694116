"""Level of detail (Eq. 16): the cutoff curvature as a function of the number of modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from engine.arrays import F64, I64

AREA_SHARE = 0.9


def cutoff_curvature(delta: F64, areas: F64) -> float:
    """Return the |H| below which 90 % of the area lies; |H| = |delta| / 2 (Fig. 7, note 3)."""
    h = np.linalg.norm(delta, axis=1) / 2
    order = np.argsort(h, kind="stable")
    filled = np.cumsum(areas[order])
    return float(h[order[np.searchsorted(filled, AREA_SHARE * filled[-1])]])


@dataclass(frozen=True, eq=False)
class Curve:
    """Cutoff curvature at knots of the number of modes, and its running maximum (Fig. 8).

    Parameters
    ----------
    knots : numbers of modes, ascending from 0.
    cutoffs : cutoff curvature at each knot, 1 / mesh unit.
    full : cutoff curvature of the original.
    m : number of modes that there can be.
    """

    knots: I64
    cutoffs: F64
    full: float
    m: int

    @classmethod
    def start(cls, delta_base: F64, delta_full: F64, areas: F64, m: int) -> Self:
        """Return the curve that knows the base and the original only."""
        base = cutoff_curvature(delta_base, areas)
        full = cutoff_curvature(delta_full, areas)
        return cls(np.array([0]), np.array([base]), full, m)

    def extended(self, delta_base: F64, modes: F64, eta: F64, areas: F64) -> Self:
        """Return the curve with the knots up to the number of columns of `modes`."""
        known = int(self.knots[-1])
        new = [k for k in knot_counts(self.m) if known < k <= modes.shape[1] and k < self.m]
        cut = [cutoff_curvature(delta_base + modes[:, :k] @ eta[:k], areas) for k in new]
        knots = np.concatenate([self.knots, np.array(new, dtype=np.int64)])
        cutoffs = np.concatenate([self.cutoffs, np.array(cut)])
        if modes.shape[1] >= self.m and knots[-1] < self.m:
            knots, cutoffs = np.append(knots, self.m), np.append(cutoffs, self.full)
        return replace(self, knots=knots, cutoffs=cutoffs)

    @property
    def levels(self) -> F64:
        """Level 0..1 at each knot: running maximum of the cutoff between base and original."""
        risen = np.maximum.accumulate(self.cutoffs)
        span = self.full - self.cutoffs[0]
        if span <= 0:
            return np.where(self.knots > 0, 1.0, 0.0)
        return np.asarray(np.clip((risen - self.cutoffs[0]) / span, 0.0, 1.0))

    def cutoff(self, k: int) -> float:
        """Return the cutoff curvature at k modes."""
        if k >= self.m:
            return self.full
        return float(np.interp(k, self.knots, self.cutoffs))

    def reaches(self, level: float) -> bool:
        """Return whether `mode_count(level)` is settled by the knots so far."""
        return level <= 0 or level >= 1 or bool(self.levels[-1] >= level)

    def mode_count(self, level: float) -> int:
        """Return the number of modes that `level` needs."""
        if level <= 0:
            return 0
        if level >= 1:
            return self.m
        i = int(np.searchsorted(self.levels, level))
        return int(self.knots[min(i, len(self.knots) - 1)])

    def level_of(self, k: int) -> float:
        """Return the level that k modes reach."""
        if k >= self.m:
            return 1.0
        return float(np.interp(k, self.knots, self.levels))


def knot_counts(m: int) -> list[int]:
    """Return the numbers of modes at which the curve is known: all up to 64, then steps of 3 %."""
    counts, k = [], 0
    while k < m:
        counts.append(k)
        k += max(1, k // 32)
    return [*counts, m]
