"""Mode shapes: K phi = lambda M phi with phi = 0 on the rim, in bands of ascending lambda.

A small region is solved densely; a larger one is cut into bands (see `engine.slicing`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64
from engine.errors import EngineError
from engine.run import Run
from engine.slicing import sliced
from engine.threads import while_polling

DENSE_LIMIT = 1500
DENSE_LARGEST = 8000


def bands(
    stiffness: sp.csr_array, areas: F64, modes: int, run: Run | None = None
) -> Iterator[tuple[F64, F64]]:
    """Yield (eigenvalues (b,), modes (m, b)) in ascending order until `modes` or more are there.

    Parameters
    ----------
    stiffness : K_II, (m, m), symmetric positive definite.
    areas : M_II, (m,), positive.
    modes : how many to compute, at most m.
    run : progress and cancel.

    Raises
    ------
    EngineError
        So many modes of so large a region are out of reach.
    SolveError
        Modes cannot be computed accurately, or not without a gap.
    Cancelled

    Notes
    -----
    Modes are M-orthonormal, each with its largest entry positive. The bands do not depend on
    `modes`, so that the first modes are the same to the last bit however many follow.

    Source: Orbay et al. 2012, Section 5.1.2; Dirichlet at the rim.
    """
    run = run or Run()
    m = len(areas)
    root = np.sqrt(areas)
    d = sp.diags_array(1 / root)
    s = sp.csr_array(d @ stiffness @ d)
    few = m > DENSE_LIMIT and modes <= m // 4
    if not few and m > DENSE_LARGEST:
        raise EngineError(
            f"{modes} modes of {m} vertices are out of reach. Ask for at most {m // 4}."
        )
    done = 0
    for values, rows in sliced(s, float(areas.sum()), run) if few else whole(s, run):
        if len(values):
            yield values, _as_modes(rows, root)
        done += len(values)
        if done >= modes:
            return


def whole(s: sp.csr_array, run: Run) -> Iterator[tuple[F64, F64]]:
    """Yield all eigenpairs of S (m, m) at once by a dense solver, (m,) and (m, m); rows."""
    values, vectors = while_polling(run, lambda: np.linalg.eigh(s.toarray()))
    yield values, vectors.T


def _as_modes(rows: F64, root: F64) -> F64:
    """Return unit rows of S as M-orthonormal columns with the largest entry positive."""
    scaled = rows / root
    peak = scaled[np.arange(len(rows)), np.abs(scaled).argmax(axis=1)]
    scaled[peak < 0] *= -1
    return np.asarray(scaled.T)
