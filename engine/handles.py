"""Anchors: what is asked of them, and the displacement of the region that answers (Eq. 17).

The energy d^T N d of `Lse` with the rows C d = r asked of the anchors gives

    d = R C^T lambda,    (C S C^T + slack) lambda = r,    R = N^-1 E,  S = E^T N^-1 E

where E picks the anchors' degrees of freedom. R and S do not depend on the targets: moving a target
is a small dense solve and one matrix product.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import scipy.linalg as sla

from engine import cholmod
from engine.arrays import F64, I64
from engine.condensed import Condensed
from engine.errors import SolveError
from engine.lse import Lse
from engine.run import Run
from engine.threads import while_polling

# Rows are met to this fraction of an anchor's own compliance: far below a pixel, and enough to keep
# the dense system regular when two strokes share an anchor and disagree.
_FIRM = 1e-10
_ROWS_OF_ONE_STROKE = 2
LARGEST_RESPONSE = 400_000_000
# Two sight planes fix a direction well from about 16 degrees between them.
_WELL_FIXED = 0.02


@dataclass(frozen=True, eq=False)
class Rows:
    """What is asked of anchors: direction . d = distance, in the region's frame.

    Parameters
    ----------
    anchors : (q,) positions in the list of anchors, one a row.
    directions : (q, 3) unit vectors.
    distances : (q,) how far the anchor shall go along the direction.
    softness : (q,) 0 asks for it exactly; 1 gives way as much as the surface does.
    """

    anchors: I64
    directions: F64
    distances: F64
    softness: F64

    @classmethod
    def stacked(cls, parts: list[Rows]) -> Rows:
        """Return the rows of several parts as one."""
        return cls(
            np.concatenate([p.anchors for p in parts]),
            np.concatenate([p.directions for p in parts]),
            np.concatenate([p.distances for p in parts]),
            np.concatenate([p.softness for p in parts]),
        )

    def agreed(self) -> Rows:
        """Return rows that do not contradict each other at any anchor.

        Where one stroke asks, its two rows stay. Where several do, the rows at the anchor are
        replaced by their least-squares answer along the directions that they fix well. Two sight
        planes that are nearly parallel and not the same meet far away, at the eye when both come
        from one camera: taken literally they would drag the surface there.
        """
        count = np.bincount(self.anchors)
        shared = count[self.anchors] > _ROWS_OF_ONE_STROKE
        if not shared.any():
            return self
        at, which = np.unique(self.anchors[shared], return_inverse=True)
        D, r = self.directions[shared], self.distances[shared]
        weight = 1.0 / (1.0 + self.softness[shared])
        normal = np.zeros((len(at), 3, 3))
        np.add.at(normal, which, weight[:, None, None] * D[:, :, None] * D[:, None, :])
        asked = np.zeros((len(at), 3))
        np.add.at(asked, which, (weight * r)[:, None] * D)
        values, axes = np.linalg.eigh(normal)
        kept = values > _WELL_FIXED * values[:, -1:]
        way = np.einsum("qab,qa->qb", axes, asked) / np.where(kept, values, 1.0)
        i, k = np.nonzero(kept)
        softness = np.bincount(which, self.softness[shared]) / np.bincount(which)
        rest = Rows(
            self.anchors[~shared],
            self.directions[~shared],
            self.distances[~shared],
            self.softness[~shared],
        )
        return Rows.stacked([rest, Rows(at[i], axes[i, :, k], way[i, k], softness[i])])


class Answers(Protocol):
    """How a surface answers forces on the degrees of freedom of its anchors."""

    def compliance(self) -> F64:
        """Return S = E^T N^-1 E, (c, c)."""
        ...

    def answer(self, force: F64) -> F64:
        """Return N^-1 E f for forces f (c,), as (3m,)."""
        ...


class Responses:
    """Answers from a solve for each degree of freedom; works with every solver.

    Parameters
    ----------
    lse : the region's energy.
    unit : (c,) degrees of freedom.
    run : progress and cancel.
    largest_bytes : how large the response matrix may be. Beyond it only the anchors' own rows are
        kept, and an answer takes one more solve instead of a matrix product.
    """

    def __init__(
        self, lse: Lse, unit: I64, run: Run, largest_bytes: int = LARGEST_RESPONSE
    ) -> None:
        self._lse = lse
        self._unit = unit
        whole = 8 * 3 * lse.m * len(unit) <= largest_bytes
        self._response = lse.responses(unit, run) if whole else None
        own = lse.responses(unit, run, at=unit) if self._response is None else self._response[unit]
        self._compliance = (own + own.T) / 2

    def compliance(self) -> F64:
        """Return S, (c, c)."""
        return self._compliance

    def answer(self, force: F64) -> F64:
        """Return N^-1 E f, (3m,)."""
        if self._response is not None:
            return np.asarray(self._response @ force)
        load = np.zeros(3 * self._lse.m)
        load[self._unit] = force
        return self._lse.factor.solve(load)


class Handles:
    """The answers of a region's surface to its anchors.

    Parameters
    ----------
    lse : the region's energy.
    anchors : (c,) positions of the anchors in the region's `roi`, ascending, each once.
    run : progress and cancel.
    answers : how the surface answers; None for the quickest way at hand.
    """

    def __init__(self, lse: Lse, anchors: I64, run: Run, answers: Answers | None = None) -> None:
        self.m = lse.m
        self.anchors = anchors
        unit = (3 * anchors[:, None] + np.arange(3)).ravel()
        self._answers = answers or answers_of(lse, unit, run)
        self.compliance: F64 = self._answers.compliance()

    def displacement(self, rows: Rows) -> F64:
        """Return the displacements (m, 3) that meet `rows` with the least energy.

        Raises
        ------
        SolveError
            The result is not finite.
        """
        if not rows.distances.any():
            return np.zeros((self.m, 3))
        # C S C^T, with three entries in each row of C.
        at = 3 * rows.anchors[:, None] + np.arange(3)
        across = np.einsum("cqa,qa->qc", self.compliance[:, at], rows.directions)
        schur = np.einsum("rqa,qa->rq", across[:, at], rows.directions)
        q = np.arange(len(at))
        schur[q, q] *= 1.0 + _FIRM + rows.softness
        try:
            multipliers = sla.cho_solve(sla.cho_factor(schur, lower=True), rows.distances)
        except (sla.LinAlgError, ValueError) as error:
            raise SolveError(
                "What the strokes and pins ask for cannot be solved. Draw the last one again."
            ) from error
        force = np.zeros(len(self.compliance))
        np.add.at(force, at, multipliers[:, None] * rows.directions)
        d = self._answers.answer(force)
        if not np.isfinite(d).all():
            raise SolveError("The deformed surface is not finite. Draw the last stroke again.")
        return np.asarray(d).reshape(-1, 3)


def answers_of(lse: Lse, unit: I64, run: Run) -> Answers:
    """Return the quickest answers at hand that are right.

    Raises
    ------
    SolveError
        None is.
    Cancelled
    """
    if len(unit) == 0 or not cholmod.usable():
        return Responses(lse, unit, run)
    for energy in (lse, lse.on_original):
        try:
            return while_polling(run, partial(_condensed, energy, unit))
        except SolveError:
            continue
    return Responses(lse, unit, run)


def _condensed(lse: Lse, unit: I64) -> Condensed:
    condensed = Condensed(lse.matrix, unit)
    # All forces at once, by one combination that cancels nothing.
    force = 1.0 + np.arange(len(unit)) % 7 / 7.0
    lse.check(condensed.answer(force)[:, None], unit, force[:, None])
    return condensed
