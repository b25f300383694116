"""The lowest modes of a large region, sliced into bands with none missing.

Shifts s_0 = 0 < s_1 < ... cut the spectrum. The inertia of S - s I counts the eigenvalues below
each; a Lanczos iteration at each shift finds those next to it; where the findings of two
neighbours meet they must agree and make up the count. Two shifts are worked on side by side.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain, repeat

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64
from engine.errors import SolveError
from engine.lanczos import Mark, Pairs, Shift, pairs_near, shift_at
from engine.run import Run
from engine.threads import results

# Modes below the first shift after 0, then from shift to shift in each round; the last goes on.
FIRST_COUNT = 52
STEPS = (26, 51, 76)
OVERLAP = 3
# How much a shift may hold more than it was meant to, before one is put nearer.
SLACK = 1.6
SAME = 1e-7
ROUNDING = 1e-14
# Vectors advanced together: eigenvalues of up to that multiplicity are found at once.
BLOCK = 4
WIDEST_BLOCK = 24
# New searches for what is missing between two shifts, and how many may find nothing in a row.
MOST_ATTEMPTS = 100
MOST_BARREN = 6


@dataclass(frozen=True, eq=False)
class Edge:
    """A place in the spectrum up to which all is known, and a head start on what lies above.

    Parameters
    ----------
    value : the place.
    count : number of eigenvalues below it.
    values, rows : eigenpairs next above it, ascending.
    """

    value: float
    count: int
    values: F64
    rows: F64


def sliced(s: sp.csr_array, area: float, run: Run) -> Iterator[tuple[F64, F64]]:
    """Yield eigenpairs of S in ascending order, band by band; vectors are unit rows.

    Parameters
    ----------
    s : M^-1/2 K M^-1/2, (m, m), positive definite.
    area : sum of M, for a first guess of how dense the spectrum is (Weyl's law).
    run : asked for cancellation.
    """
    with _Pool() as pool:
        slicer = _Slicer(s, run, pool)
        previous: F64 | None = None
        for values, rows in chain(slicer.first(area), slicer.rest()):
            if previous is not None:
                rows = _orthogonal_to(previous, rows)
            previous = rows if len(rows) else previous
            yield values, rows


class _Pool(ThreadPoolExecutor):
    """Two workers; leaving does not wait for them, for they look at `run.cancelled` themselves."""

    def __init__(self) -> None:
        super().__init__(2, thread_name_prefix="modes")

    def __exit__(self, *_: object) -> None:
        self.shutdown(wait=False, cancel_futures=True)


class _Slicer:
    """The state of the sweep from one pair of shifts to the next."""

    def __init__(self, s: sp.csr_array, run: Run, pool: ThreadPoolExecutor) -> None:
        self.s = s
        self.m = s.shape[0]
        self.block = BLOCK
        self.run = run
        self.pool = pool
        self.edge = Edge(0.0, 0, np.zeros(0), np.zeros((0, self.m)))
        self.seen = [(0.0, 0)]

    def first(self, area: float) -> Iterator[tuple[F64, F64]]:
        """Yield the modes below the first shift."""
        zero_job = self.pool.submit(shift_at, self.s, 0.0)
        near_job = self.pool.submit(self._first_shift, area)
        zero, near = results(self.run, [zero_job, near_job])
        half = (near.count + 1) // 2 + OVERLAP
        at_zero, at_near = self._search([zero, near], [(0, half), (half, STEPS[0] // 2 + OVERLAP)])
        mark = near.mark
        # Factors and basis vectors are large: none is kept while the modes are handed over.
        del zero, near, zero_job, near_job
        self.edge = Edge(0.0, 0, at_zero.above, at_zero.vectors_above)
        yield self._between(self.edge, mark, at_near)
        self._move_to(mark, at_near)

    def rest(self) -> Iterator[tuple[F64, F64]]:
        """Yield the modes above, two shifts at a time, until there are no more."""
        for step in chain(STEPS, repeat(STEPS[-1])):
            low, high = self._two_shifts(step)
            gaps = np.diff([self.edge.count, low.count, high.count])
            half = int(gaps[1] + 1) // 2 + OVERLAP
            down = max(int(gaps[0]) - len(self.edge.values), 0) + OVERLAP
            at_low, at_high = self._search([low, high], [(down, half), (half, step // 2 + OVERLAP)])
            marks = low.mark, high.mark
            del low, high
            for mark, found in zip(marks, (at_low, at_high), strict=True):
                yield self._between(self.edge, mark, found)
                self._move_to(mark, found)
            del at_low, at_high, found
            if self.edge.count >= self.m:
                return

    def _search(self, shifts: list[Shift], reach: list[tuple[int, int]]) -> list[Pairs]:
        jobs = [
            self.pool.submit(pairs_near, shift, below, above, self.block, self.run)
            for shift, (below, above) in zip(shifts, reach, strict=True)
        ]
        return results(self.run, jobs)

    def _move_to(self, mark: Mark, found: Pairs) -> None:
        self.edge = Edge(mark.value, mark.count, found.above, found.vectors_above)
        self.seen.append((mark.value, mark.count))

    def _first_shift(self, area: float) -> Shift:
        value = 4 * np.pi * FIRST_COUNT / area
        for _ in range(12):
            shift = shift_at(self.s, value)
            if 0.6 * FIRST_COUNT <= shift.count <= 1.7 * FIRST_COUNT:
                break
            value *= FIRST_COUNT / max(shift.count, FIRST_COUNT / 8)
        return shift

    def _two_shifts(self, step: int) -> tuple[Shift, Shift]:
        """Return shifts about `step` and twice that many modes above the edge."""
        guesses = [self._place_of(self.edge.count + i * step) for i in (1, 2)]
        low, high = results(self.run, [self.pool.submit(shift_at, self.s, g) for g in guesses])
        # The spectrum may be denser here than below: then nearer shifts, by the counts just seen.
        for _ in range(8):
            floor = self.edge.count
            if low.count - floor > SLACK * step + len(self.edge.values):
                high, low = low, self._halfway(self.edge.value, floor, low, step)
            elif high.count - low.count > SLACK * step:
                high = self._halfway(low.value, low.count, high, step)
            else:
                break
        return low, high

    def _halfway(self, value: float, count: int, above: Shift, step: int) -> Shift:
        part = min(step / (above.count - count), 0.5)
        job = self.pool.submit(shift_at, self.s, value + part * (above.value - value))
        return results(self.run, [job])[0]

    def _place_of(self, count: int) -> float:
        """Return where about `count` eigenvalues lie below, from the density seen lately."""
        known = len(self.edge.values)
        top = float(self.edge.values[-1]) if known else self.edge.value
        top_count = self.edge.count + known
        # Weyl's law is N = a lambda - b sqrt(lambda): the slope of the upper half guides best.
        old, old_count = max((p for p in self.seen if p[0] <= top / 2), default=(0.0, 0))
        density = (top_count - old_count) / (top - old)
        return float(max(top + (count - top_count) / density, self.edge.value * 1.0001))

    def _between(self, edge: Edge, shift: Mark, found: Pairs) -> tuple[F64, F64]:
        """Return the eigenpairs from an edge to a shift, as many as the two counts say."""
        gap = shift.count - edge.count
        up, down = edge.values, found.below
        inside = int(np.searchsorted(up, shift.value))
        up = up[:inside]
        down = down[down > edge.value]
        if len(up) + len(down) >= gap and _agree(up, down, gap):
            cut = _widest_gap(up, down, gap)
            below = gap - cut
            values = np.concatenate([up[:cut], down[:below][::-1]])
            low = edge.rows[:cut]
            high = _orthogonal_to(low, found.vectors_below[:below][::-1])
            return values, np.concatenate([low, high])
        known = np.concatenate([edge.rows[:inside], found.vectors_below[: len(down)]])
        return complete(self.s, edge, shift, known, self.block, self.run)


def _agree(up: F64, down: F64, gap: int) -> bool:
    """Return whether the i-th from below is the (gap - 1 - i)-th from above wherever both exist."""
    if len(up) > gap or len(down) > gap:
        return False
    first = gap - len(down)
    both = up[first:]
    return bool(np.all(np.abs(both - down[::-1][: len(both)]) <= SAME * np.abs(both)))


def _widest_gap(up: F64, down: F64, gap: int) -> int:
    """Return how many to take from below, cutting where neighbours lie furthest apart."""
    values = np.concatenate([up, down[::-1][len(up) + len(down) - gap :]])
    lowest, highest = gap - len(down), len(up)
    cuts = np.arange(max(lowest, 0), min(highest, gap) + 1)
    padded = np.concatenate([[-np.inf], values, [np.inf]])
    return int(cuts[np.argmax(padded[cuts + 1] - padded[cuts])])


def complete(
    s: sp.csr_array, edge: Edge, shift: Mark, known: F64, block: int, run: Run
) -> tuple[F64, F64]:
    """Return all eigenpairs between an edge and a shift when the quick search left some out.

    Eigenvalues of high multiplicity (many equal islands) hide their copies from one Krylov space;
    what is found is taken out and the search begun again from other vectors until the count is met.

    Parameters
    ----------
    s : S, (m, m).
    edge, shift : where the band begins and ends, with the number of eigenvalues below each.
    known : (b, m) rows near eigenvectors, from the quick search.
    block : how many vectors a search begins with, at the least.

    Raises
    ------
    SolveError
        The count is not met after a number of searches.
    """
    gap = shift.count - edge.count
    # Nothing outside is nearer to the middle than what is missing inside.
    middle = shift_at(s, edge.value + 0.5 * (shift.value - edge.value))
    values, rows = _rayleigh_ritz(s, known, edge.value, shift.value)
    barren = 0
    for attempt in range(1, MOST_ATTEMPTS):
        missing = gap - len(values)
        if missing <= 0 or barren == MOST_BARREN:
            break
        wide = min(max(missing, block), WIDEST_BLOCK)
        found = pairs_near(middle, wide, wide, wide, run, attempt, rows)
        more = np.concatenate([found.vectors_below, found.vectors_above])
        had = len(values)
        values, rows = _rayleigh_ritz(s, np.concatenate([rows, more]), edge.value, shift.value)
        barren = 0 if len(values) > had else barren + 1
    if len(values) != gap:
        raise SolveError(
            "The vibration modes of this region cannot be computed without a gap. "
            "Clean the mesh there, or choose another region."
        )
    return values, rows


def _rayleigh_ritz(s: sp.csr_array, rows: F64, low: float, high: float) -> tuple[F64, F64]:
    """Return the true eigenpairs within the span of `rows` whose values lie in (low, high)."""
    if len(rows) == 0:
        return np.zeros(0), rows
    size, turn = np.linalg.eigh(rows @ rows.T)
    keep = size > 1e-6
    basis = (turn[:, keep] / np.sqrt(size[keep])).T @ rows
    values, y = np.linalg.eigh(basis @ (s @ basis.T))
    vectors = y.T @ basis
    left = np.linalg.norm((s @ vectors.T).T - values[:, None] * vectors, axis=1)
    # S v itself is not known better than this: beside slivers S is large and lambda is not.
    rounding = np.linalg.norm((abs(s) @ np.abs(vectors.T)).T, axis=1) * ROUNDING
    good = (left <= 1e-7 * values + rounding) & (values > low) & (values < high)
    return values[good], vectors[good]


def _orthogonal_to(previous: F64, rows: F64) -> F64:
    """Return the rows of one band made orthogonal to those of the band before."""
    h = rows @ previous.T
    if h.size == 0 or np.abs(h).max() < 1e-12:
        return rows
    mended = rows - h @ previous
    return np.asarray(mended / np.linalg.norm(mended, axis=1, keepdims=True))
