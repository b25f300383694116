"""The only place that factorises a sparse matrix; `factorise` picks the best solver at hand.

CHOLMOD where its library is present (see `engine.cholmod`), SuperLU as the floor. Both free the
interpreter's lock while they work, give the same bits on every run, and pass the same tests.
"""

from __future__ import annotations

from typing import Any, Literal, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from engine import cholmod
from engine.arrays import F64
from engine.errors import SolveError

RESIDUAL_LIMIT = 1e-6

Backend = Literal["cholmod", "superlu"]


class _Solver(Protocol):
    @property
    def negative(self) -> int: ...

    def solve(self, b: F64) -> F64: ...


class SuperLUSolver:
    """P^T A P = L U by SuperLU in symmetric mode, with the diagonal as pivots."""

    def __init__(self, a: sp.csr_array) -> None:
        try:
            self._lu: Any = spla.splu(
                sp.csc_array(a),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SolveError(
                "The equations of the region have no unique solution. "
                "Clean the mesh, or choose another region."
            ) from error

    @property
    def negative(self) -> int:
        """Number of negative pivots, which is that of the negative eigenvalues (Sylvester)."""
        return int(np.count_nonzero(self._lu.U.diagonal() < 0))

    def solve(self, b: F64) -> F64:
        """Return x with A x = b for b (n,) or (n, r)."""
        return np.asarray(self._lu.solve(np.asfortranarray(b)))


class Factor:
    """A factorised symmetric matrix.

    Parameters
    ----------
    a : (n, n) symmetric, both triangles stored. It is scaled to unit diagonal before it is
        factorised, so that entries of very different size do no harm.
    definite : whether it is positive definite.
    backend : which solver.
    """

    def __init__(self, a: sp.csr_array, definite: bool, backend: Backend) -> None:
        self._a = a
        self.backend = backend
        diagonal = np.abs(a.diagonal())
        self._scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        rows = np.repeat(self._scale, np.diff(a.indptr))
        scaled = a.copy()
        scaled.data *= rows * self._scale[a.indices]
        self._solver: _Solver = (
            cholmod.CholmodFactor(scaled, definite)
            if backend == "cholmod"
            else SuperLUSolver(scaled)
        )
        if definite and self._solver.negative > 0:
            raise SolveError(
                "The equations of the region have no unique solution. "
                "Clean the mesh, or choose another region."
            )

    @property
    def n(self) -> int:
        """Number of rows."""
        return int(self._a.shape[0])

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of the matrix (its inertia)."""
        return self._solver.negative

    def solve_unchecked(self, b: F64) -> F64:
        """Return x with A x = b as the triangular solves give it (for inner iterations)."""
        s = self._scale if b.ndim == 1 else self._scale[:, None]
        return np.asarray(s * self._solver.solve(s * b))

    def solve(self, b: F64) -> F64:
        """Return x with A x = b for b (n,) or (n, r), refined once where needed and checked.

        Raises
        ------
        SolveError
            The result is not finite or its relative residual is above 1e-6.
        """
        size = float(np.linalg.norm(b))
        x = self.solve_unchecked(b)
        r = b - self._a @ x
        if float(np.linalg.norm(r)) > 1e-12 * size:
            x = x + self.solve_unchecked(r)
            r = b - self._a @ x
        if not np.isfinite(x).all() or not float(np.linalg.norm(r)) <= RESIDUAL_LIMIT * size:
            raise SolveError(
                "The equations of the region cannot be solved accurately. "
                "Clean the mesh, or choose another region."
            )
        return x


def best_backend() -> Backend:
    """Return the solver that `factorise` takes: CHOLMOD where it is usable, else SuperLU."""
    return "cholmod" if cholmod.usable() else "superlu"


def factorise(a: sp.csr_array, definite: bool = True, backend: Backend | None = None) -> Factor:
    """Factorise a symmetric matrix with the best solver at hand.

    Parameters
    ----------
    a : (n, n) symmetric, both triangles stored.
    definite : False for a shifted matrix K - s M; then `negative` counts eigenvalues below s.
    backend : take this solver; None for the best.

    Raises
    ------
    SolveError
        The matrix is singular, not finite, or not definite although it should be.
    """
    if not np.isfinite(a.data).all():
        raise SolveError(
            "The equations of the region hold numbers that are not finite. "
            "Clean the mesh, or choose another region."
        )
    tidy = sp.csr_array(a)
    tidy.sum_duplicates()
    return Factor(tidy, definite, backend or best_backend())
