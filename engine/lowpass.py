"""Detail below a cutoff without its modes: a matrix-free spectral filter (for Eqs. 13-15).

Where there are too many modes to compute, the part of a residual below a cutoff mu is had by a
smooth step f of the eigenvalue,

    f(lambda) = (1 + erf(t / WIDTH)) / 2,   t = (mu - lambda) / (mu + lambda) in (-1, 1],

and t is the eigenvalue of X = 2 mu (S + mu)^-1 - 1, so that f is a Chebyshev series in X: a fixed
number of solves with one definite factor, whatever the mesh, and a bound on the error that does not
depend on it either. A mode at the cutoff is kept by half, one 10 % above or below in lambda by 4 %
or 96 %; that the step is smooth also keeps it from ringing.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.sparse as sp
from scipy.special import erf

from engine.arrays import F64
from engine.errors import Cancelled
from engine.run import Run
from engine.solve import factorise

WIDTH = 0.04
DEGREE = 192


def step(eigenvalue: F64, cutoff: float) -> F64:
    """Return f(lambda) in 0..1, (k,): what share of each mode the filter keeps."""
    t = (cutoff - eigenvalue) / (cutoff + eigenvalue)
    return np.asarray((1 + erf(t / WIDTH)) / 2)


@cache
def _coefficients() -> tuple[float, ...]:
    """Chebyshev coefficients of (1 + erf(t / WIDTH)) / 2 on [-1, 1], exact to about 1e-7."""
    series = np.polynomial.chebyshev.chebinterpolate(lambda t: (1 + erf(t / WIDTH)) / 2, DEGREE)
    return tuple(float(c) for c in series)


def lowpass(s: sp.csr_array, r: F64, cutoff: float, run: Run) -> F64:
    """Return f(S) r for symmetric positive definite S (m, m) and r (m, c).

    Raises
    ------
    Cancelled
        The run was cancelled; it is asked before every solve.
    """
    eye = sp.eye_array(s.shape[0], format="csr")
    factor = factorise(sp.csr_array(s + cutoff * eye))

    def apply(x: F64) -> F64:
        if run.cancelled:
            raise Cancelled
        return 2 * cutoff * factor.solve_unchecked(x) - x

    c = _coefficients()
    older, old = r, apply(r)
    total = c[0] * older + c[1] * old
    for coefficient in c[2:]:
        older, old = old, 2 * apply(old) - older
        total += coefficient * old
    return total
