"""Mode shapes: K phi = lambda M phi with phi = 0 on the rim, in bands of ascending lambda."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from engine.arrays import F64
from engine.run import Run

DENSE_LIMIT = 1500


def bands(
    stiffness: sp.csr_array, areas: F64, modes: int, run: Run | None = None
) -> Iterator[tuple[F64, F64]]:
    """Yield (eigenvalues (b,), modes (m, b)) in ascending order until `modes` are there.

    Parameters
    ----------
    stiffness : K_II, (m, m), symmetric positive definite.
    areas : M_II, (m,), positive.
    modes : how many to compute, at most m.

    Notes
    -----
    Modes are M-orthonormal, each with its largest entry (the first of them) positive.

    Source: Orbay et al. 2012, Section 5.1.2; Dirichlet at the rim.
    """
    run = run or Run()
    root = np.sqrt(areas)
    d = sp.diags_array(1 / root)
    s = sp.csr_array(d @ stiffness @ d)
    if len(areas) <= DENSE_LIMIT:
        values, vectors = np.linalg.eigh(s.toarray())
    else:
        v0 = np.ones(len(areas))
        values, vectors = spla.eigsh(sp.csc_array(s), min(modes, len(areas) - 1), sigma=0, v0=v0)
    order = np.argsort(values, kind="stable")[:modes]
    phi = np.asfortranarray(vectors[:, order] / root[:, None])
    yield values[order], signed(phi)


def signed(phi: F64) -> F64:
    """Return the modes with the sign that makes the largest entry of each positive."""
    largest = phi[np.abs(phi).argmax(axis=0), np.arange(phi.shape[1])]
    return np.asfortranarray(phi * np.where(largest < 0, -1.0, 1.0))
