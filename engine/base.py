"""The base shape (Eqs. 9-10): the region's smoothest surface between its rims.

Rule "smooth" holds two rings of positions and asks for the delta that a surface of least curvature
variation has, h n with a smooth h:

    x = argmin sum_j M_j |(M^-1 K x)_j - h_j n_j|^2                                        (*)

h, twice the mean curvature, solves Eq. 9 as a scalar, K h = 0 inside, with the values of the rim
(Eq. 10) evened out along it, so that features there do not leak in. n are the normals of the round
before; the first round has h = 0 and is Eq. 9 for the vector delta, K M^-1 K x = 0. Alone it pulls
whatever is round inwards, for vectors that point apart average to something shorter: a tube as long
as its girth loses two fifths of its radius, and folds at the rim.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from engine.arrays import F64, I64
from engine.errors import SolveError
from engine.region import Region
from engine.solve import Factor, factorise

Rim = Literal["smooth", "paper"]

# No vertex of a base lies further from where it was, in diagonals of the region.
FARTHEST = 1.0
# Rounds of (*) after the first, until the surface moves less than this (of the region's diagonal).
ROUNDS = 6
STILL = 1e-4
# A round must move the surface less than this share of what the one before did.
CALMING = 0.6
# A part may bend so much more than on the original: where that is fair already, the two are alike.
# Beyond, what little closed rim there is has misled.
BENT = 1.1
# How far the rim's curvature is evened out along it: to about this share of its length.
EVENNESS = 0.1


def base_shape(region: Region, factor: Callable[[], Factor], rim: Rim = "smooth") -> F64:
    """Return the base shape of a region in the patch's frame, (m, 3).

    Parameters
    ----------
    region : the region.
    factor : gives K_II factorised; only rule "paper" asks for it, and needs no other.
    rim : "smooth" holds the positions of two rings and asks for the least variation of the mean
        curvature; "paper" holds one ring and the Laplacian coordinates on it (Eq. 10).

    Raises
    ------
    SolveError
        The base is not finite, or lies further than `FARTHEST` from the region.

    Notes
    -----
    Where the paper's Eq. 10 keeps delta at the rim of the featured surface, the features leak into
    the base. The rule "smooth" is therefore the default: its base meets the two rings in position
    and, through them, in slope.

    Source: Orbay et al. 2012, Eqs. 9, 10.
    """
    base = levelled_base(region) if rim == "smooth" else paper_base(region, factor())
    moved = np.linalg.norm(base - region.x[: region.m], axis=1)
    if not np.isfinite(base).all() or moved.max() > FARTHEST:
        raise SolveError(
            "The base shape of this region runs away from the model. "
            "Choose a smaller region, or clean the mesh there."
        )
    return base


def levelled_base(region: Region) -> F64:
    """Return the solution of (*), (m, 3); the rim's curvature is worked out beside the plate."""
    with ThreadPoolExecutor(1, thread_name_prefix="engine") as beside:
        bend = beside.submit(RimBend, region)
        plate = Plate(region)
        x = plate.plain()
        return plate.levelled(x, bend.result())


def paper_base(region: Region, factor: Factor) -> F64:
    """Return the base of Eq. 10, (m, 3), by two Dirichlet solves with one factor of K_II.

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


class Plate:
    """A region held at two rings, factorised: sum_j M_j |delta_j - wanted_j|^2 over roi and rim.

    Vertices whose ring of faces is open carry no delta and are left out of the sum, so that a
    border inside or beside the region acts as a hinge and a plane stays a plane. Those of a freed
    border keep instead the pull that the surface has on them on the original.

    Parameters
    ----------
    region : the region.
    stay : adds `stay` sum_i M_i |x_i - wanted_i|^2 over the roi; see `change`.
    """

    def __init__(self, region: Region, stay: float = 0.0) -> None:
        self._region = region
        m = region.m
        near = m + len(region.rim)
        left_out = region.rim_open & (np.arange(near) >= m)
        weight = np.where(left_out, 0.0, 1 / region.laplacian.areas[:near])
        self._rows = sp.csr_array(region.laplacian.stiffness[:near])
        inner = sp.csr_array(self._rows[:, :m])
        self._pull = np.where(region.rim_open[:, None], self._rows @ region.x, 0.0)
        weighted = inner.copy()
        weighted.data *= np.repeat(weight, np.diff(inner.indptr))
        self._turned = sp.csr_array(weighted.T)
        self._held = self._rows[:, m:] @ region.x[m:]
        matrix = sp.csr_array(self._turned @ inner)
        self._stay: F64 = stay * region.laplacian.areas[:m]
        if stay > 0:
            matrix.setdiag(matrix.diagonal() + self._stay)
        self._factor = factorise(matrix)

    def fitted(self, wanted: F64) -> F64:
        """Return the positions (m, 3) with M delta nearest to `wanted`, (near, 3)."""
        return self._factor.solve(self._turned @ (wanted + self._pull - self._held))

    def change(self, bend: F64, offset: F64) -> F64:
        """Return v (m, 3), 0 where held, with K v nearest to `bend` and v near to `offset`.

        Parameters
        ----------
        bend : (near, 3) as a load, M delta.
        offset : (m, 3) counts as much as `stay` says.
        """
        return self._factor.solve(self._turned @ bend + self._stay[:, None] * offset)

    def plain(self) -> F64:
        """Return the positions (m, 3) with K M^-1 K x = 0: Eq. 9 for the vector delta."""
        return self.fitted(np.zeros_like(self._pull))

    def levelled(self, plain: F64, foretold: RimBend) -> F64:
        """Return the positions (m, 3) of least variation of the mean curvature.

        Each part of the region goes on while the rounds calm down, whatever the others do.

        Parameters
        ----------
        plain : (m, 3) from `plain`, to start from.
        foretold : the bend that the rim asks for.
        """
        if foretold.bend is None:
            return plain
        region, near = self._region, len(self._pull)
        m = region.m
        x = region.x.copy()
        x[:m] = plain
        normals, bend = foretold.normals, foretold.bend
        parts, part = foretold.parts, foretold.part[:m]
        areas = region.laplacian.areas[:m]
        calm = plain.copy()
        share = areas / np.bincount(part, areas, parts)[part]
        before, going = np.full(parts, np.inf), np.ones(parts, dtype=bool)
        for _ in range(ROUNDS):
            new = self.fitted(bend[:, None] * normals.at(x)[:near])
            moved = ((new - x[:m]) ** 2).sum(axis=1)
            step = np.sqrt(np.bincount(part, share * moved, parts))
            going &= step <= CALMING * before
            # The first round counts once the second has shown that it led somewhere.
            kept = (going & ((before < np.inf) | (step < STILL)))[part]
            calm[kept] = new[kept]
            going &= step >= STILL
            if not going.any():
                break
            x[:m], before = new, step
        x[:m] = calm
        bent, bent_before = (self._bending(p, foretold) for p in (x, region.x))
        worse = bent > BENT * bent_before
        away = np.linalg.norm(calm - region.x[:m], axis=1) > FARTHEST
        worse |= np.bincount(part, away, parts) > 0
        return np.where(worse[part][:, None], plain, calm)

    def _bending(self, x: F64, foretold: RimBend) -> F64:
        """Return sum_j M_j |delta_j|^2 of each part, (parts,), over vertices with a closed ring."""
        region, near = self._region, len(self._pull)
        weight = np.where(region.rim_open, 0.0, 1 / region.laplacian.areas[:near])
        bent = weight * ((self._rows @ x) ** 2).sum(axis=1)
        return np.bincount(foretold.part, bent, foretold.parts).astype(np.float64)


class RimBend:
    """The bend that the rim asks for all over a region, M h.

    Attributes
    ----------
    bend : (near,) M h over roi and rim; None where no curvature can be foretold, since faces are
        wound both ways or weights are negative beyond all measure.
    normals : of any positions of the patch.
    parts, part : number of connected parts, and (near,) which one each vertex belongs to.
    """

    def __init__(self, region: Region) -> None:
        near = region.m + len(region.rim)
        rows = sp.csr_array(region.laplacian.stiffness[:near])
        self.normals = _Normals(region.faces, len(region.x))
        self.parts, self.part = connected_components(rows[:, :near], directed=False)
        self.bend: F64 | None = None
        if self.normals.outward:
            try:
                h = self._curvature(region, rows)
            except SolveError:
                return
            self.bend = region.laplacian.areas[:near] * h

    def _curvature(self, region: Region, rows: sp.csr_array) -> F64:
        """Return h (near,): that of the rim, evened out, carried into the region with K h = 0.

        (W + t K) h = W h_rim with W the areas of the rim's vertices and 0 elsewhere.
        """
        near, part = len(self.part), self.part
        areas = region.laplacian.areas[:near]
        rim = ~region.rim_open & (np.arange(near) >= region.m)
        own = np.where(rim, areas, 0.0)
        k = sp.csr_array(rows[:, :near])
        k = k - sp.diags_array(np.asarray(k.sum(axis=1)))
        spread = EVENNESS * np.bincount(part, own)[part]
        normals = self.normals.at(region.x)[:near]
        bend = np.where(rim, ((rows @ region.x) * normals).sum(axis=1), 0.0)
        # A trace of M: a part of the region whose rim is all open border has no h, and gets 0.
        mass = sp.diags_array(own + 1e-9 * areas)
        h = factorise(sp.csr_array(mass + sp.diags_array(spread) @ k)).solve(bend)
        return np.where(region.rim_open, 0.0, h)


class _Normals:
    """Area-weighted unit normals of positions over fixed faces.

    Attributes
    ----------
    outward : whether all faces are wound alike, so that normals have a side.
    """

    def __init__(self, faces: I64, n: int) -> None:
        self._faces = faces
        corner = np.repeat(np.arange(len(faces)), 3)
        self._sum = sp.csr_array(
            (np.ones(3 * len(faces)), (faces.ravel(), corner)), shape=(n, len(faces))
        )
        ways = np.sort((faces * np.int64(n) + np.roll(faces, -1, axis=1)).ravel())
        self.outward = bool((ways[1:] != ways[:-1]).all())

    def at(self, x: F64) -> F64:
        """Return the normals (n, 3) of positions x (n, 3); zero where no face has an area."""
        a, b, c = (x[self._faces[:, k]] for k in range(3))
        summed = self._sum @ np.cross(b - a, c - a)
        length = np.linalg.norm(summed, axis=1, keepdims=True)
        unit: F64 = np.divide(summed, length, out=np.zeros_like(summed), where=length > 0)
        return unit
