"""Level of detail (Eq. 16): the cutoff curvature as a function of the number of modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from engine.arrays import F64, I64

AREA_SHARE = 0.9

# The part of the slider that counts modes instead of curvature. The running maximum of the cutoff
# may reach the original's long before the last mode: the surface would jump at level 1.
COUNT_SHARE = 0.01


def cutoff_curvature(delta: F64, areas: F64) -> float:
    """Return the |H| below which 90 % of the area lies; |H| = |delta| / 2 (Fig. 7, note 3).

    Parameters
    ----------
    delta : (m, 3) Laplacian coordinates, 1 / mesh unit.
    areas : (m,) of the vertices.
    """
    h = np.sqrt(np.einsum("ij,ij->i", delta, delta)) / 2
    order = np.argsort(h)
    filled = np.cumsum(areas[order])
    return float(h[order[np.searchsorted(filled, AREA_SHARE * filled[-1])]])


@dataclass(frozen=True, eq=False)
class Curve:
    """Cutoff curvature at knots of the number of modes, and the level that they stand for (Fig. 8).

    Parameters
    ----------
    knots : numbers of modes, ascending from 0, as far as the modes are known.
    cutoffs : cutoff curvature at each knot, 1 / mesh unit.
    full : cutoff curvature of the original.
    m : number of modes that there can be.

    Notes
    -----
    kappa(k) is not monotone (44 of 147 steps of five modes fell on a measured example): its
    running maximum is taken. What a level means is settled once a knot reaches it, and does not
    change with what is computed later; until then the last knot and the original are joined by a
    straight line, so that the slider is alive from the start.

    Source: Orbay et al. 2012, Eq. 16, Figs. 7 and 8; the last symbol of Eq. 16 is kappa_full.
    """

    knots: I64
    cutoffs: F64
    full: float
    m: int

    @classmethod
    def start(cls, base: float, full: float, m: int) -> Self:
        """Return the curve that knows the cutoffs of base and original only."""
        return cls(np.array([0], dtype=np.int64), np.array([base]), full, m)

    def with_knots(self, knots: list[int], cutoffs: list[float]) -> Self:
        """Return the curve with more knots above those it has."""
        return replace(
            self,
            knots=np.concatenate([self.knots, np.array(knots, dtype=np.int64)]),
            cutoffs=np.concatenate([self.cutoffs, np.array(cutoffs, dtype=np.float64)]),
        )

    @property
    def levels(self) -> F64:
        """Level 0..1 at each knot, (knots,); it never falls."""
        share = self.knots / self.m
        span = self.full - self.cutoffs[0]
        if span <= 1e-9 * self.full:
            return np.asarray(share)
        risen = (np.maximum.accumulate(self.cutoffs) - self.cutoffs[0]) / span
        level = (1 - COUNT_SHARE) * np.clip(risen, 0.0, 1.0) + COUNT_SHARE * share
        return np.where(self.knots >= self.m, 1.0, level)

    @property
    def _joined(self) -> tuple[I64, F64]:
        if self.knots[-1] >= self.m:
            return self.knots, self.levels
        return np.append(self.knots, self.m), np.append(self.levels, 1.0)

    def cutoff(self, k: int) -> float:
        """Return the cutoff curvature at k modes; between knots by a straight line."""
        return float(np.interp(k, *self._whole))

    def count_at(self, cutoff: float) -> int:
        """Return the fewest modes whose cutoff curvature reaches `cutoff`; m where none does."""
        knots, cutoffs = self._whole
        risen = np.maximum.accumulate(cutoffs)
        i = int(np.searchsorted(risen, cutoff))
        if i in (0, len(risen)):
            return 0 if i == 0 else self.m
        part = (cutoff - cutoffs[i - 1]) / (cutoffs[i] - cutoffs[i - 1])
        return int(np.ceil(knots[i - 1] + part * (knots[i] - knots[i - 1]) - 1e-6))

    @property
    def _whole(self) -> tuple[I64, F64]:
        """Knots and cutoffs up to the original, known or not."""
        if self.knots[-1] >= self.m:
            return self.knots, self.cutoffs
        return np.append(self.knots, self.m), np.append(self.cutoffs, self.full)

    def reaches(self, level: float) -> bool:
        """Return whether `mode_count(level)` is settled by the knots so far."""
        return level <= 0 or level >= 1 or bool(self.levels[-1] >= level)

    def mode_count(self, level: float) -> int:
        """Return the number of modes that `level` needs: 0 at 0, m at 1, never falling between."""
        if not level > 0:
            return 0
        if level >= 1:
            return self.m
        knots, levels = self._joined
        i = int(np.searchsorted(levels, level))
        below, above = levels[i - 1], levels[i]
        part = (level - below) / (above - below)
        # The hair taken off keeps level_of(k) -> k exact in spite of rounding.
        return int(np.ceil(knots[i - 1] + part * (knots[i] - knots[i - 1]) - 1e-6))

    def level_of(self, k: int) -> float:
        """Return the level that k modes reach (inverse of `mode_count`)."""
        knots, levels = self._joined
        return float(np.interp(k, knots, levels))


def off_form(surface: F64, original: F64, areas: F64) -> float:
    """Return how far a surface is off the original, as a share of the size of the original.

    It is the root mean square distance over the square root of the area. The base of a patch, or of
    a sleeve between two rims, is 0.01 to 0.05 off; that of a cup or an end, which has one rim only,
    is a thin waist or a flat lid 0.1 to 0.3 off.

    Parameters
    ----------
    surface, original : (m, 3) positions.
    areas : (m,) of the vertices.
    """
    away = ((surface - original) ** 2).sum(axis=1)
    whole = float(areas.sum())
    return float(np.sqrt((areas * away).sum())) / whole if whole > 0 else 0.0


def next_knot(k: int) -> int:
    """Return the knot after k: every number of modes up to 64, then steps of 3 %."""
    return k + max(1, k // 32)
