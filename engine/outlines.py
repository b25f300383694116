"""Outlines brought onto their targets, by what the anchors of their strokes are asked for.

What is asked of an anchor, in pixels inwards, the outline beside it answers in full, hardly, or by
coming from elsewhere: a strong pull has other parts of the flank stand out. Near enough it answers
in full, and what is left over is asked for in addition. Where that is not enough, what each part of
the curve does to the outline is worked out, and the least squares of what is left are gone down.

Source: Levenberg 1944, "A method for the solution of certain non-linear problems in least squares".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from engine.arrays import F64, I64
from engine.contour import OutlineAim, without_gaps

if TYPE_CHECKING:
    from engine.edit import Stroke

MET_PX = 0.1  # an outline this near to its target is met
_ROUNDS = 5
# A round of asking for what is left over must leave less than this share, or it is given up.
_QUICK = 0.6
_DESCENTS, _TRIALS = 8, 4
_PARTS = 16  # of a stroke, that are asked for more or less each
_CLOSE_PX = 0.25  # so near, going on would be paid with folds
_DAMPING, _LESS, _MORE = 1e-2, 1 / 6, 4.0
_WORTH = 0.02  # share of what is left that a descent must take off, or it is the last


@dataclass(frozen=True, eq=False)
class Asked:
    """What was asked of the anchors, and what came of it.

    Parameters
    ----------
    inwards : (c,) px that anchors stay inside their targets, those of all outlines in order.
    moved : (m, 3) how the surface answered.
    level : (n, 3) where that brings it.
    beyond : (q,) px that outlines go beyond their targets; NaN where none is seen.
    """

    inwards: F64
    moved: F64
    level: F64
    beyond: F64


class Outlines:
    """The outlines that strokes aim at.

    Parameters
    ----------
    aims : of the strokes that aim at one, by their place among all.
    strokes : all strokes.
    answer : returns the displacement (m, 3) for strokes and the surface (n, 3) that it leads to, or
        None where there is no sound one.
    ways : returns displacements (b, m, 3) for lists of strokes, to first order, less those for
        `strokes`, as they are added to the surface.
    roi : (m,) ids of what moves, ascending.
    """

    def __init__(
        self,
        aims: Mapping[int, OutlineAim],
        strokes: Sequence[Stroke],
        answer: Callable[[Sequence[Stroke]], tuple[F64, F64] | None],
        ways: Callable[[list[list[Stroke]]], F64],
        roi: I64,
    ) -> None:
        self._aims = aims
        self._strokes = strokes
        self._answer = answer
        self._ways = ways
        self._roi = roi
        self._cuts = np.cumsum([len(strokes[i].anchors) for i in aims])[:-1]

    def met(self, moved: F64, level: F64) -> tuple[F64, float]:
        """Return the displacement that brings outlines nearest, and how far they are off, px.

        Parameters
        ----------
        moved, level : (m, 3) and (n, 3) the answer to the strokes as they are.
        """
        asked = self._first(moved, level)
        if not self._seen(asked.beyond):
            return moved, 0.0
        nearest = self._quickly(asked, _ROUNDS)
        if self._off(nearest.beyond) > MET_PX:
            nearest = self._downhill(nearest)
        return nearest.moved, self._off(nearest.beyond)

    def nearer(self, moved: F64, level: F64) -> tuple[F64, float]:
        """Return the displacement that one round gives, and how far outlines are off then, px.

        Parameters
        ----------
        moved, level : (m, 3) and (n, 3) the answer to the strokes as they are.
        """
        asked = self._first(moved, level)
        if not self._seen(asked.beyond):
            return moved, 0.0
        nearest = self._quickly(asked, 1)
        return nearest.moved, self._off(nearest.beyond)

    def _first(self, moved: F64, level: F64) -> Asked:
        count = sum(len(self._strokes[i].anchors) for i in self._aims)
        return Asked(np.zeros(count), moved, level, self._beyond(level))

    def _quickly(self, asked: Asked, rounds: int) -> Asked:
        """Ask for what is left over in addition, as long as that helps."""
        for _ in range(rounds):
            off = self._off(asked.beyond)
            further = self._asked(asked.inwards + self._even(asked.beyond))
            now = np.inf if further is None else self._off(further.beyond)
            if further is not None and now < off:
                asked = further
            if now <= MET_PX or now > _QUICK * off:
                break
        return asked

    def _downhill(self, asked: Asked) -> Asked:
        """Go down the squares of what is left, by what each part of a stroke does to it."""
        parts = self._parts()
        ways = self._ways([self._inside(part) for part in parts.T])
        damping, nearest = _DAMPING, asked
        for _ in range(_DESCENTS):
            left, rates = self._left(asked), self._rates(asked, ways)
            normal = rates.T @ rates
            scale = np.trace(normal) / len(normal)
            if not scale > 0:
                break
            better = None
            for _ in range(_TRIALS):
                damped = normal + damping * scale * np.eye(len(normal))
                step = np.linalg.solve(damped, -(rates.T @ left))
                tried = self._asked(asked.inwards + parts @ step)
                if tried is not None and _squares(self._left(tried)) < _squares(left):
                    better = tried
                    break
                damping *= _MORE
            if better is None:
                break
            gain = 1.0 - np.sqrt(_squares(self._left(better)) / _squares(left))
            asked, damping = better, damping * _LESS
            if self._off(asked.beyond) < self._off(nearest.beyond):
                nearest = asked
            if gain < _WORTH or self._off(nearest.beyond) <= _CLOSE_PX:
                break
        return nearest

    def _parts(self) -> F64:
        """Return the shares (c, b) that each anchor has in the parts of its stroke."""
        counts = [len(self._strokes[i].anchors) for i in self._aims]
        blocks = [
            _splines(c, self._strokes[i].closed) for c, i in zip(counts, self._aims, strict=True)
        ]
        whole = np.zeros((sum(counts), sum(block.shape[1] for block in blocks)))
        row = column = 0
        for block in blocks:
            whole[row : row + block.shape[0], column : column + block.shape[1]] = block
            row, column = row + block.shape[0], column + block.shape[1]
        return whole

    def _asked(self, inwards: F64) -> Asked | None:
        """Return what comes of asking; None where there is no surface or no outline."""
        found = self._answer(self._inside(inwards))
        if found is None:
            return None
        beyond = self._beyond(found[1])
        return Asked(inwards, *found, beyond) if self._seen(beyond) else None

    def _inside(self, inwards: F64) -> list[Stroke]:
        of = dict(zip(self._aims, np.split(inwards, self._cuts), strict=True))
        return [
            self._aims[i].inside(of[i]) if i in of else stroke
            for i, stroke in enumerate(self._strokes)
        ]

    def _beyond(self, level: F64) -> F64:
        return np.concatenate([aim.beyond(level) for aim in self._aims.values()])

    def _left(self, asked: Asked) -> F64:
        return np.concatenate([without_gaps(b) for b in self._split(asked.beyond)])

    def _rates(self, asked: Asked, ways: F64) -> F64:
        found = [aim.slopes(asked.level, ways, self._roi) for aim in self._aims.values()]
        return np.concatenate(found)

    def _even(self, beyond: F64) -> F64:
        pairs = zip(self._aims.values(), self._split(beyond), strict=True)
        return np.concatenate([aim.even(b) for aim, b in pairs])

    def _off(self, beyond: F64) -> float:
        return float(np.abs(self._even(beyond)).max())

    def _split(self, beyond: F64) -> list[F64]:
        return np.split(beyond, np.cumsum([aim.places for aim in self._aims.values()])[:-1])

    def _seen(self, beyond: F64) -> bool:
        return all(2 * np.isfinite(b).sum() >= len(b) for b in self._split(beyond))


def _squares(left: F64) -> float:
    return float(left @ left)


def _splines(c: int, closed: bool) -> F64:
    """Return smooth shares (c, b) of c anchors in b parts of their curve, that sum to 1."""
    b = min(c, _PARTS)
    if b == c or c < 4:
        return np.eye(c)
    at = np.arange(c) * (b / c if closed else (b - 1) / (c - 1))
    values = np.eye(b)
    if closed:
        around = np.vstack([values, values[:1]])
        return np.asarray(CubicSpline(np.arange(b + 1), around, bc_type="periodic")(at))
    return np.asarray(CubicSpline(np.arange(b), values, bc_type="natural")(at))
