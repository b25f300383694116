"""Shift-invert Lanczos: the eigenpairs of a symmetric matrix next to a shift.

Rows, not columns, hold the basis: with few new vectors against many old ones the products
`w @ basis.T` and `h @ basis` are several times faster in this order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64
from engine.errors import Cancelled, SolveError
from engine.run import Run
from engine.solve import Factor, factorise

SEED = 20120101
TOLERANCE = 1e-10
# Blocks that are made orthogonal to all before them at a time.
PERIOD = 2
# ... unless more than this may be lost of their orthogonality before.
MOST_LOST = 1e-11


@dataclass(frozen=True, eq=False)
class Shift:
    """A place s in the spectrum of S, with S - s I factorised.

    Parameters
    ----------
    value : s.
    count : number of eigenvalues of S below s, from the inertia of the factor.
    factor : S - s I.
    """

    value: float
    count: int
    factor: Factor

    @property
    def mark(self) -> Mark:
        """The place alone, without the factor."""
        return Mark(self.value, self.count)


@dataclass(frozen=True)
class Mark:
    """A place in the spectrum and the number of eigenvalues below it."""

    value: float
    count: int


def shift_at(s: sp.csr_array, value: float) -> Shift:
    """Return the shift of S (m, m) at `value`, moved a hair where the factor is not accurate.

    Raises
    ------
    SolveError
        No factor near `value` is accurate.
    """
    probe = np.ones(s.shape[0])
    for attempt in range(6):
        moved = value * (1 + 1e-6 * attempt)
        shifted = sp.csr_array(s - moved * sp.eye_array(s.shape[0], format="csr"))
        try:
            factor = factorise(shifted, definite=moved == 0)
            x = factor.solve_unchecked(probe)
            r = probe - shifted @ x
            # Measured against the size of what was subtracted: near an eigenvalue x is large.
            if np.linalg.norm(r) <= 1e-9 * max(np.linalg.norm(probe), moved * np.linalg.norm(x)):
                return Shift(moved, factor.negative, factor)
        except SolveError:
            if value == 0:
                raise
    raise SolveError(
        "The vibration modes of this region cannot be computed accurately. "
        "Clean the mesh there, or choose another region."
    )


@dataclass(frozen=True, eq=False)
class Pairs:
    """Eigenpairs next to a shift, consecutive as far as the iteration can tell.

    Parameters
    ----------
    below, above : eigenvalues on either side, nearest to the shift first.
    vectors_below, vectors_above : their unit vectors as rows.
    """

    below: F64
    above: F64
    vectors_below: F64
    vectors_above: F64


class Krylov:
    """An orthonormal basis of the block Krylov space of (S - s I)^-1, and the operator in it.

    Parameters
    ----------
    shift : the shift.
    start : (b, n) rows to start from; any, they are made orthonormal.
    room : number of basis vectors that there is room for at first.
    run : asked for cancellation at every step.
    locked : (l, n) orthonormal rows that the space is kept orthogonal to.
    """

    def __init__(
        self, shift: Shift, start: F64, room: int, run: Run, locked: F64 | None = None
    ) -> None:
        self._shift = shift
        self._run = run
        self._locked = np.zeros((0, start.shape[1])) if locked is None else locked
        self.block, self.n = start.shape
        self._rows = np.empty((room + self.block, self.n))
        self._small = np.zeros((room + self.block, room + self.block))
        first = start - (start @ self._locked.T) @ self._locked
        self._rows[: self.block] = _orthonormal(first, SEED, self._locked)[0]
        self.size = 0
        self._mended = self.block
        self._lost = self._largest = 0.0
        self._coupling = np.zeros((self.block, self.block))

    @property
    def basis(self) -> F64:
        """The basis so far, (size, n)."""
        return self._rows[: self.size]

    def step(self) -> None:
        """Apply the operator to the newest block and make what it gives orthogonal to all.

        In exact arithmetic it is orthogonal already to all but the last two blocks. Rounding spoils
        that slowly, so the rest is seen to for several blocks at a time, which costs half as much.

        Raises
        ------
        Cancelled
        """
        if self._run.cancelled:
            raise Cancelled
        b, j = self.block, self.size
        if j + 2 * b > len(self._rows):
            self._grow()
        known = self._rows[: j + b]
        w = np.ascontiguousarray(self._shift.factor.solve_unchecked(known[j:].T).T)
        if len(self._locked):
            w -= (w @ self._locked.T) @ self._locked
        before = np.linalg.norm(w)
        near = known[max(j - b, 0) :]
        h = w @ near.T
        w -= h @ near
        again = w @ near.T
        w -= again @ near
        h += again
        here = h[:, -b:]
        self._small[j : j + b, j : j + b] = (here + here.T) / 2
        if np.linalg.norm(w) < 1e-3 * before:
            w -= (w @ known.T) @ known
        q, self._coupling = _orthonormal(w, SEED + j + 1, known)
        self._rows[j + b : j + 2 * b] = q
        self._small[j : j + b, j + b : j + 2 * b] = self._coupling
        self._small[j + b : j + 2 * b, j : j + b] = self._coupling.T
        self.size = j + b
        # What is lost of orthogonality grows by at most |A^-1| / |coupling| in a step.
        self._largest = max(self._largest, float(before) / np.sqrt(b))
        smallest = max(float(np.abs(np.diagonal(self._coupling)).min()), 1e-300)
        self._lost = (self._lost + 1e-16) * max(self._largest / smallest, 1.0)
        if self._lost > MOST_LOST or self.size - self._mended >= PERIOD * b:
            self._mend()

    def _mend(self) -> None:
        """Make the newest blocks orthogonal to all before them, and to each other."""
        end = self.size + self.block
        new, known = self._rows[self._mended : end], self._rows[: self._mended]
        new -= (new @ known.T) @ known
        # One step of Newton's iteration for the nearest orthonormal rows.
        new[:] = (1.5 * np.eye(len(new)) - 0.5 * (new @ new.T)) @ new
        self._mended, self._lost = end, 0.0

    def ritz(self) -> tuple[F64, F64, F64]:
        """Return Ritz values theta (size,), their coefficients as columns, and residual norms."""
        theta, y = np.linalg.eigh(self._small[: self.size, : self.size])
        left = self._coupling.T @ y[self.size - self.block :]
        return theta, y, np.linalg.norm(left, axis=0)

    def vectors(self, theta: F64, y: F64) -> F64:
        """Return Ritz vectors (v, n) as unit rows, improved by one application of the operator.

        Parameters
        ----------
        theta, y : (v,) and (size, v) of those that are wanted, from `ritz`.
        """
        left = (self._coupling.T @ y[self.size - self.block :]) / theta
        tail = self._rows[self.size : self.size + self.block]
        v = np.ascontiguousarray(y.T) @ self.basis
        v += left.T @ tail
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        return np.asarray(v)

    def _grow(self) -> None:
        more = max(len(self._rows) // 2, 4 * self.block)
        rows = np.empty((len(self._rows) + more, self.n))
        rows[: len(self._rows)] = self._rows
        small = np.zeros((len(rows), len(rows)))
        small[: len(self._small), : len(self._small)] = self._small
        self._rows, self._small = rows, small


def pairs_near(
    shift: Shift,
    below: int,
    above: int,
    block: int,
    run: Run,
    seed: int = 0,
    locked: F64 | None = None,
) -> Pairs:
    """Return at least `below` and `above` eigenpairs on either side of a shift.

    Fewer are returned only where S has no more on that side.

    Parameters
    ----------
    shift : the shift.
    below, above : how many are wanted.
    block : vectors advanced together; finds eigenvalues of that multiplicity.
    run : asked for cancellation.
    seed : chooses the start vectors.
    locked : (l, n) unit eigenvectors to be left out of the search.
    """
    n = shift.factor.n
    below = min(below, shift.count)
    above = min(above, n - shift.count)
    wanted = below + above
    start = np.random.default_rng(SEED + seed).standard_normal((block, n))
    start = np.ascontiguousarray(shift.factor.solve_unchecked(start.T).T)
    krylov = Krylov(shift, start, int(2.6 * wanted) + 40, run, locked)
    most = n - (0 if locked is None else len(locked)) - block
    check = int(1.8 * wanted) + 12
    while True:
        while krylov.size < check and krylov.size < most:
            krylov.step()
        theta, y, left = krylov.ritz()
        found = _split(theta, left)
        exhausted = krylov.size >= most
        if (len(found[0]) >= below and len(found[1]) >= above) or exhausted:
            break
        check = krylov.size + max(block, krylov.size // 12)
    lo, hi = found[0][: below + 4], found[1][: above + 4]
    values = shift.value + 1 / theta
    return Pairs(
        values[lo], values[hi], krylov.vectors(theta[lo], y[:, lo]),
        krylov.vectors(theta[hi], y[:, hi]),
    )  # fmt: skip


def _split(theta: F64, left: F64) -> tuple[list[int], list[int]]:
    """Return positions of the converged Ritz values on either side, up to the first that is not."""
    good = left <= TOLERANCE * np.abs(theta)
    below = [int(i) for i in np.argsort(theta) if theta[i] < 0]
    above = [int(i) for i in np.argsort(-theta) if theta[i] > 0]
    return _leading(below, good), _leading(above, good)


def _leading(order: list[int], good: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[int]:
    for place, i in enumerate(order):
        if not good[i]:
            return order[:place]
    return order


def _orthonormal(w: F64, seed: int, known: F64 | None = None) -> tuple[F64, F64]:
    """Return q with orthonormal rows and c with w = c q; dependent rows get fresh directions."""
    b, n = w.shape
    coefficients = np.zeros((b, b))
    size = np.linalg.norm(w, axis=1)
    for i in range(b):
        for _ in range(2):
            h = w[:i] @ w[i]
            w[i] -= h @ w[:i]
            coefficients[i, :i] += h
        length = float(np.linalg.norm(w[i]))
        if length > 1e-13 * max(float(size.max()), 1e-300):
            coefficients[i, i] = length
            w[i] /= length
            continue
        fresh: F64 = np.asarray(np.random.default_rng(seed + i).standard_normal(n))
        for _ in range(3):
            if known is not None:
                fresh -= (known @ fresh) @ known
            fresh -= (w[:i] @ fresh) @ w[:i]
            fresh /= np.linalg.norm(fresh)
        w[i] = fresh
    return w, coefficients
