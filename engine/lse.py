"""Laplacian surface editing (Eqs. 7, 8): the rows, without anchors.

Every vertex i has a similarity T_i, linear in the unknown positions of its one-ring, that best
takes the ring at rest to the ring deformed; the energy asks the deformed Laplacian coordinate to
be the rest one carried by T_i:

    E(x') = sum_i | T_i(x') delta_i - (L x')_i |^2 M_i        (Eq. 7, integrated over the surface)

Written as rows, E = |A x'|^2 (Eq. 8 with L_LSE = A).

Source: Sorkine et al. 2004; Orbay et al. 2012, Eqs. 7, 8.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from engine.arrays import B1, F64, I64
from engine.errors import SolveError
from engine.operators import laplacian
from engine.region import Region
from engine.run import Run
from engine.solve import RESIDUAL_LIMIT, Factor, factorise
from engine.threads import two_at_a_time

_RING_FLOOR = 1e-9
_BLOCK = 64
# In the region's frame the softest clamped surface resists with about 1e3 M.
_STILLNESS = 1e-4
_LEAST_AREA = 1e-4
# Where the surface grows stiffer towards the rim, and by how much at most.
_SOFT = 0.4
_STIFFEST = 1e3


def cross_matrices(v: F64) -> F64:
    """Return [v]x with [v]x u = v x u, for v (..., 3), as (..., 3, 3)."""
    m = np.zeros((*v.shape, 3))
    m[..., 0, 1], m[..., 0, 2] = -v[..., 2], v[..., 1]
    m[..., 1, 0], m[..., 1, 2] = v[..., 2], -v[..., 0]
    m[..., 2, 0], m[..., 2, 1] = -v[..., 1], v[..., 0]
    return m


def ring_similarity_blocks(edges: F64, weights: F64, starts: I64, carried: F64) -> F64:
    """Return the blocks B with T_i carried_i = sum_j B_ij e'_ij.

    T_i = s_i + [h_i]x is the similarity with the rotation linearised that fits
    e'_ij = x'_j - x'_i best over the ring: with S = sum w |e|^2 and J = sum w (|e|^2 - e e^T),

        s_i = sum_j w_ij e_ij . e'_ij / S,      h_i = J^-1 sum_j w_ij e_ij x e'_ij.

    Parameters
    ----------
    edges : (p, 3) rest edges e_ij, those of one vertex i one after the other.
    weights : (p,) positive fit weights.
    starts : (r,) where the edges of each vertex start.
    carried : (r, 3) the vector that T_i is applied to.

    Returns
    -------
    (p, 3, 3)
    """
    counts = np.diff(np.append(starts, len(edges)))
    squared = np.einsum("pa,pa->p", edges, edges)
    size = np.add.reduceat(weights * squared, starts)
    outer = np.add.reduceat(
        weights[:, None] * (edges[:, [0, 0, 0, 1, 1, 2]] * edges[:, [0, 1, 2, 1, 2, 2]]), starts
    )
    inertia = -outer[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    # A ring of collinear edges cannot tell the turn about its own line: it is taken as zero.
    inertia += (size * (1.0 + _RING_FLOOR))[:, None, None] * np.eye(3)
    turn = -np.matmul(cross_matrices(carried), np.linalg.inv(inertia))
    i = np.repeat(np.arange(len(starts)), counts)
    blocks = np.matmul(turn[i], cross_matrices(edges))
    blocks += carried[i][:, :, None] * (edges / size[i][:, None])[:, None, :]
    return np.asarray(blocks * weights[:, None, None])


def lse_rows(
    positions: F64,
    stiffness: sp.csr_array,
    areas: F64,
    rows: I64,
    turning: B1,
    columns: int | None = None,
) -> sp.bsr_array:
    """Return A (3r, 3n) in 3 by 3 blocks: row i is M_i^-1/2 (K x' - M T(x') delta)_i.

    Parameters
    ----------
    positions : (n, 3) the rest shape.
    stiffness : (n, n) K, positive semidefinite (Eq. 2). Its pattern gives the one-rings.
    areas : (n,) M.
    rows : (r,) vertices that get a row.
    turning : (r,) whether the row's delta turns and scales with its ring (T_i as in Eq. 7) or
        keeps its direction (T_i = 1).
    columns : leave out the columns of the vertices from this one on; None keeps all.

    Notes
    -----
    A annihilates the rest shape where T_i turns, and any translation and uniform scale of it;
    a rotation by a small angle leaves a residual of second order.
    """
    K = sp.csr_array(stiffness[rows])
    i = np.repeat(np.arange(len(rows)), np.diff(K.indptr))
    j = K.indices
    blocks = K.data[:, None, None] * np.eye(3)
    ring = np.flatnonzero((j != rows[i]) & turning[i])
    if len(ring):
        owner = i[ring]
        edges = positions[j[ring]] - positions[rows[owner]]
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        carried = (K @ positions)[owner[starts]]
        B = ring_similarity_blocks(edges, fit_weights(K.data[ring], starts), starts, carried)
        blocks[ring] -= B
        diagonal = np.flatnonzero(j == rows[i])
        at = np.zeros(len(rows), dtype=np.int64)
        at[i[diagonal]] = diagonal
        blocks[at[owner[starts]]] += np.add.reduceat(B, starts)
    blocks *= (1.0 / np.sqrt(areas[rows]))[i][:, None, None]
    n = len(positions) if columns is None else columns
    kept = j < n
    indptr = np.concatenate([[0], np.cumsum(kept)])[K.indptr]
    return sp.bsr_array((blocks[kept], j[kept], indptr), shape=(3 * len(rows), 3 * n))


def fit_weights(off_diagonal: F64, starts: I64) -> F64:
    """Return positive weights (e,) for fits over one-rings from entries K_ij of the stiffness.

    They are the cotangent weights where these are positive. Obtuse and sliver triangles give
    negative and huge ones, which would turn a fit round: they are held between a tenth and ten
    times the ring's mean.

    Parameters
    ----------
    off_diagonal : (e,) the entries, ring by ring.
    starts : (r,) where each ring begins.
    """
    w = np.maximum(-off_diagonal, 0.0)
    counts = np.diff(np.append(starts, len(w)))
    mean = np.repeat(np.add.reduceat(np.minimum(w, 1e12), starts) / counts, counts)
    mean = np.where(mean > 0, mean, 1.0)
    return np.clip(w, 0.1 * mean, 10.0 * mean)


def stiffening(stiffness: sp.csr_array, areas: F64, m: int, rows: I64) -> F64:
    """Return how much stiffer than in the middle the surface is at each row, (r,), 1 or more.

    It grows like one over the distance from the rim. What a clamped plate bends at its edge is
    moment over stiffness, so the bend of a change fades out to nothing at the rim instead of being
    the largest there: the change meets what is held in position, slope and curvature. For the
    distance stands the smooth u with K u = M, u = 0 at the rim.

    Parameters
    ----------
    stiffness, areas : K (n, n) and M (n,) of the rest shape, the region's m vertices first.
    m : number of vertices that move.
    rows : (r,) vertices of the region and its rim.
    """
    inner = sp.csr_array(stiffness[:m, :m])
    parts, part = connected_components(inner, directed=False)
    u = factorise(inner).solve(areas[:m])
    highest = np.full(parts, 1e-300)
    np.maximum.at(highest, part, u)
    depth = np.zeros(len(areas))
    depth[:m] = np.maximum(u / highest[part], 0.0)
    # The rim's rows lie between the rim and the first ring inside.
    ring = sp.csr_array(stiffness[rows][:, :m])
    beside = np.bincount(
        np.repeat(np.arange(len(rows)), np.diff(ring.indptr)), depth[ring.indices], len(rows)
    )
    halfway = beside / np.maximum(np.diff(ring.indptr), 1) / 2
    own = np.where(rows < m, depth[rows], halfway)
    return np.clip(_SOFT / np.maximum(own, 1e-300), 1.0, _STIFFEST)


class Lse:
    """The LSE energy of a region's surface at rest, factorised without any anchor.

    Everything outside the region stays by elimination, so it moves exactly 0. The unknowns are
    the displacements d of the region's vertices; the rest shape has no energy, so with the rows A
    of the region and its rim, E = |A d|^2 and the matrix is N = A^T A. The rows of the rim
    (with T_i = 1: what surrounds the region does not turn) ask for its bend to stay as it
    is, which keeps the surface smooth across it.

    Parameters
    ----------
    region : the region; it gives faces, rims and the frame (centred, unit diagonal).
    surface : (m, 3) rest shape of the region's vertices in that frame.
    own_metric : take K and M of the rest shape; else those of the original.

    Notes
    -----
    K and M are those of the rest shape itself, not of the featured original: stiffness then
    spreads along the surface that is shaped, and no trace of the features shows in the change.

    Departure: the sum of Eq. 7 is weighted by `stiffening`, for a surface that is as stiff
    everywhere bends most where it is held, and the rim would show it.
    """

    def __init__(self, region: Region, surface: F64, own_metric: bool = True) -> None:
        m = region.m
        self.m = m
        self.positions: F64 = region.x.copy()
        self.positions[:m] = surface
        near = np.arange(m + len(region.rim))
        self.rows: I64 = near[~region.rim_open | (near < m)]
        self._region = region
        found = laplacian(self.positions, region.faces) if own_metric else region.laplacian
        self.stiffness = found.stiffness
        # The weight of a row is 1 / M: beside a sliver it would drown all others.
        self.areas = np.maximum(found.areas, _LEAST_AREA * float(found.areas.mean()))
        self.give: F64 = self.areas.copy()
        self.give[self.rows] /= stiffening(self.stiffness, self.areas, m, self.rows)
        turning = self.rows < m
        A = lse_rows(self.positions, self.stiffness, self.give, self.rows, turning, columns=m)
        # In blocks the product is three times as fast as entry by entry. A region that hangs on a
        # vertex or two may turn and swell about them for nothing; a trace of M settles it.
        still = np.repeat(_STILLNESS * self.areas[:m], 3)
        self.matrix = sp.csr_array(sp.bsr_array(A.transpose()) @ A)
        self.matrix.sort_indices()
        self.matrix.setdiag(self.matrix.diagonal() + still)

    @cached_property
    def factor(self) -> Factor:
        """N, factorised without any anchor."""
        return factorise(self.matrix)

    @cached_property
    def on_original(self) -> Lse:
        """The same energy with K and M of the featured original.

        Features that were flattened can leave triangles without area in the rest shape, and then
        its own K and M are of no use; the original's are less true to it, but sound.
        """
        region = self._region
        return Lse(region, self.positions[: self.m], own_metric=False)

    def responses(self, unit: I64, run: Run, at: I64 | None = None) -> F64:
        """Return N^-1 e for unit forces at the degrees of freedom `unit` (u,), as (3m, u).

        Parameters
        ----------
        unit : (u,) degrees of freedom.
        run : progress and cancel.
        at : keep these rows only; None keeps all.

        Raises
        ------
        SolveError
            They do not balance the forces to 1e-6.
        Cancelled
        """
        rows = slice(None) if at is None else at
        response = np.empty((3 * self.m if at is None else len(at), len(unit)), order="F")
        # The blocks are the same whatever the number of threads, so the bits are too.
        starts = range(0, len(unit), _BLOCK)

        def solved(start: int) -> F64:
            part = unit[start : start + _BLOCK]
            force = np.zeros((3 * self.m, len(part)), order="F")
            force[part, np.arange(len(part))] = 1.0
            answer = self.factor.solve_unchecked(force)
            self.check(answer, part, np.eye(len(part)))
            return answer[rows]

        for start, block in zip(starts, two_at_a_time(run, solved, starts), strict=True):
            run.tick(0.5 + 0.5 * start / len(unit), "Preparing the anchors")
            response[:, start : start + block.shape[1]] = block
        return response

    def check(self, answers: F64, unit: I64, forces: F64) -> None:
        """Check answers (3m, r) to forces (u, r) at the degrees of freedom `unit`, all at once.

        Raises
        ------
        SolveError
            One combination of them that cancels nothing leaves a residual above 1e-6.
        """
        share = 1.0 + np.arange(forces.shape[1]) % 7 / 7.0
        load = np.zeros(3 * self.m)
        load[unit] = forces @ share
        left = np.linalg.norm(self.matrix @ (answers @ share) - load)
        if not left <= RESIDUAL_LIMIT * np.linalg.norm(load):
            raise SolveError(
                "The surface at this level cannot be prepared accurately for the anchors. "
                "Clean the mesh, or choose another region."
            )
