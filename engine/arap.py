"""As-rigid-as-possible polish of a deformed surface, for turns that a linear method stretches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from engine.arrays import F64, I64
from engine.errors import SolveError
from engine.lse import Lse
from engine.rectify import ring_rotations
from engine.run import Run
from engine.solve import Factor, factorise

# Bending is weighed so that it rules below this many edge lengths.
_BENDING_EDGES = 2.0


@dataclass(frozen=True, eq=False)
class Surroundings:
    """How what surrounds a region moves, where it does not stay.

    Parameters
    ----------
    moved : (q, 3) displacement of the patch's vertices beyond the region, in the region's frame.
    turns : (q, 3, 3) linear map of each: the identity where it stays.
    """

    moved: F64
    turns: F64


class Polish:
    """Rounds of rotations and positions that make every one-ring keep its shape.

    One round finds the local rotations R_i of the surface as it is, then the positions x' that
    minimise, with the anchors and everything outside the region held,

        sum_ij w_ij |e'_ij - R_i e_ij|^2  +  l^2 sum_i M_i |(L x')_i - R_i delta_i|^2.

    The first sum is the as-rigid-as-possible energy; its matrix is K. Departure: alone it leaves a
    crease along the anchors and the rim, because a membrane may kink where it is held. The second
    sum, the Laplacian coordinates turned rigidly, keeps the surface smooth there; l is two edges.

    Source: Sorkine and Alexa 2007, "As-rigid-as-possible surface modeling".

    Parameters
    ----------
    lse : the region's surface at rest.
    rings : ring products of that surface, from `ring_products`, the region's vertices first.
    anchors : (c,) positions in the region's `roi` of the vertices that are held.
    """

    def __init__(self, lse: Lse, rings: sp.csr_array, anchors: I64) -> None:
        m = lse.m
        self._lse = lse
        self._rings = rings[: 3 * m]
        self._anchors = anchors
        K = lse.stiffness
        self._membrane = sp.csr_array(K[:m])
        edges = K[:m].tocoo()
        apart = lse.positions[edges.row] - lse.positions[edges.col]
        away = edges.row != edges.col
        length = float(np.linalg.norm(apart[away], axis=1).mean())
        bent = sp.csr_array(K[lse.rows])
        weight = (_BENDING_EDGES * length) ** 2 / lse.give[lse.rows]
        self._bent_at_rest = bent @ lse.positions
        inner = sp.csr_array(bent[:, :m])
        self._bending = sp.csr_array(sp.csr_array(inner.T) @ sp.diags_array(weight))
        matrix = sp.csr_array(self._membrane[:, :m] + self._bending @ inner)
        self._around = sp.csr_array(self._membrane[:, m:] + self._bending @ bent[:, m:])
        self._factor: Factor = factorise(matrix)
        force = np.zeros((m, len(anchors)))
        force[anchors, np.arange(len(anchors))] = 1.0
        self._response = self._factor.solve(force) if len(anchors) else force
        compliance = self._response[anchors]
        try:
            self._compliance = sla.cho_factor((compliance + compliance.T) / 2)
        except sla.LinAlgError as error:
            raise SolveError(
                "The surface cannot be polished with these anchors. Set polish to 0."
            ) from error

    def relax(
        self,
        moved: F64,
        rounds: int,
        run: Run | None = None,
        around: Surroundings | None = None,
    ) -> F64:
        """Return the displacements (m, 3) after some rounds that start from `moved`.

        The anchors stay where `moved` has put them; what surrounds the region stays, or moves as
        `around` says.
        """
        m, x = self._lse.m, self._lse.positions
        held = moved[self._anchors]
        d = moved
        R = np.tile(np.eye(3), (len(x), 1, 1))
        rest = x
        pull: F64 = np.zeros((m, 3))
        if around is not None:
            R[m:] = around.turns
            rest = x.copy()
            rest[m:] += around.moved
            pull = self._around @ around.moved
        for i in range(rounds):
            if run is not None:
                run.tick(i / rounds, "Polishing")
            deformed = rest.copy()
            deformed[:m] += d
            R[:m] = ring_rotations(self._rings, deformed)
            d = self._factor.solve(self._load(R) - pull)
            if len(held):
                miss = held - d[self._anchors]
                d = d + self._response @ sla.cho_solve(self._compliance, miss)
                d[self._anchors] = held
        return d

    def _load(self, R: F64) -> F64:
        """Return the right side for rotations R (n, 3, 3) of the patch, (m, 3).

        sum_j w_ij (R_i + R_j) / 2 (x_i - x_j) = (R_i (K x)_i - (K R)_i x_i + (K (R x))_i) / 2.
        """
        m, x, K = self._lse.m, self._lse.positions, self._membrane
        own = np.einsum("iab,ib->ia", R[:m], K @ x)
        mixed = np.einsum("iab,ib->ia", (K @ R.reshape(-1, 9)).reshape(-1, 3, 3), x[:m])
        across = K @ np.einsum("iab,ib->ia", R, x)
        membrane = (own - mixed + across) / 2 - K @ x
        bent = self._bent_at_rest
        turned = np.einsum("iab,ib->ia", R[self._lse.rows], bent) - bent
        return np.asarray(membrane + self._bending @ turned)
