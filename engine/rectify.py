"""Local rotations between two shapes of one mesh, and detail turned by them (Eqs. 18 to 20)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64, I64
from engine.lse import fit_weights

_NEWTON_STEPS = 30
_ILL_CONDITIONED = 1e-5


def ring_products(positions: F64, stiffness: sp.csr_array, rows: I64) -> sp.csr_array:
    """Return G (3r, n) with (G x')[3 i + a] = sum_j w_ij (x_j - x_i)_a (x'_j - x'_i).

    It depends on the rest shape only, so the ring products of any deformed shape are one
    sparse product.

    Parameters
    ----------
    positions : (n, 3) rest shape.
    stiffness : (n, n) K, whose off-diagonal entries give rings and cotangent weights.
    rows : (r,) vertices wanted.
    """
    K = stiffness[rows]
    i = np.repeat(np.arange(len(rows)), np.diff(K.indptr))
    ring = K.indices != rows[i]
    i, j, w = i[ring], K.indices[ring], K.data[ring]
    n = len(positions)
    if not len(i):
        return sp.csr_array((3 * len(rows), n))
    starts = np.flatnonzero(np.diff(i, prepend=-1))
    weighted = fit_weights(w, starts)[:, None] * (positions[j] - positions[rows[i]])
    centre = np.zeros((len(rows), 3))
    centre[i[starts]] = -np.add.reduceat(weighted, starts)
    at = (3 * i[:, None] + np.arange(3)).ravel()
    own = np.arange(3 * len(rows))
    return sp.csr_array(
        (
            np.concatenate([weighted.ravel(), centre.ravel()]),
            (np.concatenate([at, own]), np.concatenate([np.repeat(j, 3), np.repeat(rows, 3)])),
        ),
        shape=(3 * len(rows), n),
    )


def ring_rotations(products: sp.csr_array, deformed: F64) -> F64:
    """Return R_i = argmin sum_j w_ij |e'_ij - R e_ij|^2 over proper rotations, (r, 3, 3).

    Departure: Eq. 18 fits a general T_i and keeps the rotation of its polar decomposition. On a
    flat ring T_i is not determined across the ring, and noise then turns R by tens of degrees; the
    best rotation itself (weighted Procrustes) is determined as long as the ring has two directions.
    Edges are taken from vertex i, so that translations do not matter.

    Source: Orbay et al. 2012, Eqs. 18, 19.
    """
    return nearest_rotations(np.swapaxes((products @ deformed).reshape(-1, 3, 3), 1, 2))


def nearest_rotations(B: F64) -> F64:
    """Return the proper rotations R (r, 3, 3) that maximise trace(R^T B).

    With B = U S V^T this is U diag(1, 1, det(U V^T)) V^T, found without a decomposition: the
    largest value l of the trace is the largest root of

        (l^2 - |B|^2)^2 - 8 l det B - 4 |cof B|^2 = 0,

    by Newton's method from above (it cannot overshoot), and R follows in closed form. The few
    matrices where that loses digits (rings that are almost a line) go through the decomposition.
    A zero matrix gives the identity.

    Source: Markley 1993, "Attitude determination using vector observations: a fast optimal
    matrix algorithm".
    """
    norm = np.sqrt(np.einsum("rab,rab->r", B, B))
    zero = ~(norm > 0)
    b = np.ascontiguousarray(np.moveaxis(B / np.where(zero, 1.0, norm)[:, None, None], 0, -1))
    cof = np.stack([_cross(b[1], b[2]), _cross(b[2], b[0]), _cross(b[0], b[1])])
    det = (b[0] * cof[0]).sum(axis=0)
    cof2 = (cof * cof).sum(axis=(0, 1))
    root = _largest_root(det, cof2)
    kappa = 0.5 * (root * root - 1.0)
    zeta = kappa * root - det
    good = zeta > _ILL_CONDITIONED
    gram = np.einsum("abr,cbr->acr", b, b)
    R = (kappa + 1.0) * b + root * cof - np.einsum("acr,cbr->abr", gram, b)
    R /= np.where(good, zeta, 1.0)
    # One step of Newton-Schulz takes what rounding left of the stretch out; with the vertices last
    # it takes a seventh of the time of as many products of small matrices.
    gram = np.einsum("abr,acr->bcr", R, R)
    R = 1.5 * R - 0.5 * np.einsum("abr,bcr->acr", R, gram)
    rotations = np.ascontiguousarray(np.moveaxis(R, -1, 0))
    bad = np.flatnonzero(~good)
    if len(bad):
        rotations[bad] = _by_decomposition(B[bad])
    rotations[zero] = np.eye(3)
    return rotations


def _cross(u: F64, v: F64) -> F64:
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def _largest_root(det: F64, cof2: F64) -> F64:
    root: F64 = np.full(det.shape, np.sqrt(3.0))
    for _ in range(_NEWTON_STEPS):
        square = root * root - 1.0
        value = square * square - 8.0 * root * det - 4.0 * cof2
        slope = 4.0 * root * square - 8.0 * det
        step = np.divide(value, slope, out=np.zeros_like(root), where=slope > 0)
        root -= step
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    return np.asarray(root)


def _by_decomposition(B: F64) -> F64:
    u, _, vt = np.linalg.svd(B)
    u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]
    return np.asarray(u @ vt)


def turned(rotations: F64, vectors: F64) -> F64:
    """Return R_i v_i for rotations (r, 3, 3) and vectors (r, 3).

    Source: Orbay et al. 2012, Eq. 20.
    """
    return np.asarray(np.einsum("rab,rb->ra", rotations, vectors))
