"""The base shape (Eqs. 9-10): the region's smoothest surface between its rims."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64
from engine.errors import SolveError
from engine.region import Region
from engine.solve import Factor, factorise

Rim = Literal["smooth", "paper"]


def base_shape(region: Region, factor: Callable[[], Factor], rim: Rim = "smooth") -> F64:
    """Return the base shape of a region in the patch's frame, (m, 3).

    Parameters
    ----------
    region : the region.
    factor : gives K_II factorised; only rule "paper" asks for it, and needs no other.
    rim : "smooth" holds the positions of two rings and solves K M^-1 K x = 0; "paper" holds one
        ring and the Laplacian coordinates on it (Eq. 10).

    Notes
    -----
    Where the paper's Eq. 10 keeps delta at the rim of the featured surface, the features leak into
    the base. The rule "smooth" is therefore the default: its base meets the two rings in position
    and, through them, in slope.

    Source: Orbay et al. 2012, Eqs. 9, 10.
    """
    base = smooth_base(region) if rim == "smooth" else paper_base(region, factor())
    moved = np.linalg.norm(base - region.x[: region.m], axis=1)
    if not np.isfinite(base).all() or moved.max() > 1.0:
        raise SolveError(
            "The base shape of this region runs away from the model. "
            "Choose a smaller region, or clean the mesh there."
        )
    return base


def paper_base(region: Region, factor: Factor) -> F64:
    """Return the base of Eq. 10 by two Dirichlet solves with one factor of K_II.

    K_II delta_I = -K_IB delta_B, then K_II x_I = M_I delta_I - K_IB x_B.
    """
    m = region.m
    k, areas, x = region.laplacian.stiffness, region.laplacian.areas, region.x
    near = m + len(region.rim)
    # Beyond the rim rows are cut off; they matter only to the few couplings of a robust Laplacian.
    k_ib = k[:m][:, m:]
    delta_b = np.zeros((len(x) - m, 3))
    delta_b[: near - m] = (k[m:near] @ x) / areas[m:near, None]
    delta_b[: near - m][region.rim_open[m:]] = 0.0
    delta = factor.solve(-(k_ib @ delta_b))
    # A freed border keeps the pull that it has on the original; with none it would shrink away.
    freed = region.rim_open[:m]
    delta[freed] = ((k[:m] @ x) / areas[:m, None])[freed]
    return factor.solve(areas[:m, None] * delta - k_ib @ x[m:])


def smooth_base(region: Region) -> F64:
    """Return the minimiser of sum_j M_j |delta_j|^2 over roi and rim, two rings held.

    Vertices whose ring of faces is open carry no delta and are left out of the sum, so that a
    border inside or beside the region acts as a hinge and a plane stays a plane. Those of a freed
    border keep instead the pull that the surface has on them on the original.
    """
    m = region.m
    near = m + len(region.rim)
    left_out = region.rim_open & (np.arange(near) >= m)
    weight = np.where(left_out, 0.0, 1 / region.laplacian.areas[:near])
    rows = sp.csr_array(region.laplacian.stiffness[:near])
    inner = sp.csr_array(rows[:, :m])
    pull = np.where(region.rim_open[:, None], rows @ region.x, 0.0)
    weighted = inner.copy()
    weighted.data *= np.repeat(weight, np.diff(inner.indptr))
    turned = sp.csr_array(weighted.T)
    load = turned @ (pull - rows[:, m:] @ region.x[m:])
    return factorise(sp.csr_array(turned @ inner)).solve(load)
