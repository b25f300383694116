"""The only place that factorises a sparse matrix; it picks the best solver at hand."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from engine.arrays import F64
from engine.errors import SolveError

RESIDUAL_LIMIT = 1e-6


class Factor(Protocol):
    """A factorised symmetric matrix."""

    @property
    def n(self) -> int:
        """Number of rows."""
        ...

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of the matrix (its inertia); 0 when it is definite."""
        ...

    def solve(self, b: F64) -> F64:
        """Return x with A x = b for b (n,) or (n, r), refined once and checked.

        Raises
        ------
        SolveError
            The result is not finite or its relative residual is above 1e-6.
        """
        ...

    def solve_unchecked(self, b: F64) -> F64:
        """Return x with A x = b as the triangular solves give it (for inner iterations)."""
        ...


class SuperLUFactor:
    """P^T A P = L U by SuperLU in symmetric mode, with the diagonal as pivots.

    Parameters
    ----------
    a : (n, n) symmetric; scaled to unit diagonal before it is factorised.
    """

    def __init__(self, a: sp.csr_array) -> None:
        self._a = a
        diagonal = np.abs(a.diagonal())
        self._scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        d = sp.diags_array(self._scale)
        scaled = sp.csc_array(d @ a @ d)
        try:
            self._lu: Any = spla.splu(
                scaled,
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
    def n(self) -> int:
        """Number of rows."""
        return int(self._a.shape[0])

    @property
    def negative(self) -> int:
        """Number of negative pivots, which is that of the negative eigenvalues (Sylvester)."""
        return int(np.count_nonzero(self._lu.U.diagonal() < 0))

    def solve_unchecked(self, b: F64) -> F64:
        """Return x with A x = b as the triangular solves give it."""
        s = self._scale if b.ndim == 1 else self._scale[:, None]
        return np.asarray(s * self._lu.solve(s * b))

    def solve(self, b: F64) -> F64:
        """Return x with A x = b, refined once and checked."""
        return checked_solve(self, self._a, b)


def factorise(a: sp.csr_array) -> Factor:
    """Factorise a symmetric matrix with the best solver at hand.

    Parameters
    ----------
    a : (n, n) symmetric, both triangles stored.

    Raises
    ------
    SolveError
        The matrix is singular, or not finite.
    """
    if not np.isfinite(a.data).all():
        raise SolveError(
            "The equations of the region hold numbers that are not finite. "
            "Clean the mesh, or choose another region."
        )
    return SuperLUFactor(a)


def checked_solve(factor: Factor, a: sp.csr_array, b: F64) -> F64:
    """Solve, refine once, and refuse what is not finite or leaves a residual above 1e-6."""
    x = factor.solve_unchecked(b)
    r = b - a @ x
    x = x + factor.solve_unchecked(r)
    size = float(np.linalg.norm(b))
    left = float(np.linalg.norm(b - a @ x))
    if not np.isfinite(x).all() or not left <= RESIDUAL_LIMIT * size:
        raise SolveError(
            "The equations of the region cannot be solved accurately. "
            "Clean the mesh, or choose another region."
        )
    return x
