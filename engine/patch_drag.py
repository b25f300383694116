"""Patches of a region taken in hand: moved rigidly or scaled, the rest of the region follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from engine.arap import Polish, Surroundings
from engine.arrays import F64, I64
from engine.decomposition import decompose_until
from engine.details import Details
from engine.errors import RegionError, SketchError, SolveError
from engine.lse import Lse, lse_rows
from engine.mesh import Mesh
from engine.rectify import ring_products, ring_rotations
from engine.run import Memo, Run

Method = Literal["smooth", "rigid"]
Motion = tuple[I64, ArrayLike]

# More rounds let a surface that is pushed together buckle, which no designer asked for.
_ROUNDS = 10
# How far a vertex may go beyond the patch's own way, in diagonals of the region.
_FARTHEST = 1.0
_LARGEST_STRETCH = 50.0


class PatchDrag:
    """A region and one or more patches of it, prepared to be dragged.

    The free part of the region, between its rim and the patches, is taken apart into the surface
    at a level and the details on it. Its surroundings are what stays and each patch, which goes as
    it is told, its own details with it. Between them the surface at the level takes the
    displacements d of least energy, with A the rows of `Lse` and B those of the surroundings,

        |A d + B d_out - t|^2,    t_i = M_i^-1/2 ((S - 1) K x)_i  for i in a patch's border,

    that is, the Laplacian coordinates of a patch's border are carried by its own linear map S, so
    that the surface leaves the patch as smoothly as before. Method "rigid" then goes on with
    as-rigid-as-possible rounds. The details are turned and put back (Eqs. 18 to 20); they are zero
    at the patches and at the rim.

    Source: Sorkine et al. 2004; Sorkine and Alexa 2007; Orbay et al. 2012 for the details.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) vertex ids of the region.
    patch : (p,) vertex ids of all patches, inside the region.
    level : level of detail in 0..1 of the surface that is bent.

    Raises
    ------
    RegionError
        The patch does not leave a free part of the region around itself.
    """

    def __init__(self, mesh: Mesh, roi: I64, patch: I64, level: float, run: Run) -> None:
        free = np.setdiff1d(roi, patch)
        if len(patch) == 0 or len(free) == 0:
            raise RegionError(
                "The handle leaves nothing of the region to bend. "
                "Take a smaller handle, or choose a larger region."
            )
        parts = decompose_until(mesh, free, level, run=run)
        run.tick(0.5, "Preparing the handle")
        region = parts.region
        m = parts.m
        self._mesh = mesh
        self._parts = parts
        self._k = parts.mode_count(level)
        self._rest = parts.surface(self._k)
        self._lse = lse = Lse(region, (self._rest - region.centre) / region.scale)
        rows = lse_rows(lse.positions, lse.stiffness, lse.give, lse.rows, lse.rows < m)
        A = sp.csr_array(rows)
        self._free = sp.csr_array(A[:, : 3 * m].T)
        self._around = sp.csr_array(A[:, 3 * m :])
        carried = np.isin(region.patch[m:], patch)
        borders = np.flatnonzero(lse.rows >= m)
        self._borders = borders[carried[lse.rows[borders] - m]]
        of = lse.rows[self._borders]
        bend = sp.csr_array(lse.stiffness[of]) @ lse.positions
        self._bend: F64 = bend / np.sqrt(lse.give[of])[:, None]
        self._details = Details(parts, self._k)
        self._rings = ring_products(lse.positions, lse.stiffness, self._details.rows)
        self._polish: Polish | None = None

    def moved(self, motions: Sequence[Motion], method: Method, run: Run | None = None) -> F64:
        """Return all vertices (n, 3) after each patch went by its matrix.

        Parameters
        ----------
        motions : the ids of each patch and its (4, 4) similarity, x' = matrix @ (x, 1), mesh units.
        method : "smooth" for the linear solve alone, "rigid" to keep shapes in larger turns.
        run : cancel.

        Raises
        ------
        SketchError
            A matrix is no sensible similarity.
        SolveError
            The surface is not finite or runs away.
        """
        run = run or Run()
        told = [(ids, checked_similarity(matrix)) for ids, matrix in motions]
        region = self._parts.region
        vertices = self._mesh.vertices.copy()
        if all((np.eye(4) == M).all() for _, M in told):
            return vertices
        around = self._surroundings(told)
        d = self._bent(around, told)
        if method == "rigid":
            d = self._relaxed(d, around, run)
        self._guard(d, around.moved)
        run.tick(0.9, "Putting the details back")
        vertices[region.roi] = self._detailed(d, around.moved)
        for ids, M in told:
            vertices[ids] = self._mesh.vertices[ids] @ M[:3, :3].T + M[:3, 3]
        return vertices

    def _surroundings(self, told: list[tuple[I64, F64]]) -> Surroundings:
        region = self._parts.region
        at = region.patch[self._parts.m :]
        x = self._mesh.vertices[at]
        moved, turns = np.zeros((len(at), 3)), np.tile(np.eye(3), (len(at), 1, 1))
        for ids, M in told:
            carried = np.isin(at, ids)[:, None]
            moved = np.where(carried, (x @ M[:3, :3].T + M[:3, 3] - x) / region.scale, moved)
            turns = np.where(carried[:, :, None], M[:3, :3], turns)
        return Surroundings(moved, turns)

    def _bent(self, around: Surroundings, told: list[tuple[I64, F64]]) -> F64:
        wanted = np.zeros((len(self._lse.rows), 3))
        at = self._parts.region.patch[self._lse.rows[self._borders]]
        for ids, M in told:
            bent = self._bend @ (M[:3, :3] - np.eye(3)).T
            carried = np.isin(at, ids)[:, None]
            wanted[self._borders] = np.where(carried, bent, wanted[self._borders])
        load = wanted.ravel() - self._around @ around.moved.ravel()
        return self._lse.factor.solve(self._free @ load).reshape(-1, 3)

    def _relaxed(self, d: F64, around: Surroundings, run: Run) -> F64:
        if self._polish is None:
            self._polish = Polish(self._lse, self._rings, np.zeros(0, dtype=np.int64))
        return self._polish.relax(d, _ROUNDS, run, around)

    def _detailed(self, d: F64, around: F64) -> F64:
        """Return the free part with its details turned and put back (Eq. 20)."""
        parts, lse = self._parts, self._lse
        shifted = parts.original + d * parts.region.scale
        deformed = lse.positions.copy()
        deformed[: lse.m] += d
        deformed[lse.m :] += around
        R = ring_rotations(self._rings, deformed)
        return np.asarray(shifted + self._details.turning(R))

    def _guard(self, d: F64, around: F64) -> None:
        farthest = float(np.linalg.norm(d, axis=1).max(initial=0.0))
        asked = float(np.linalg.norm(around, axis=1).max(initial=0.0))
        if not farthest <= _FARTHEST + 2.0 * asked:
            raise SolveError(
                "The surface runs away from the handle. Move the handle less far, or choose a "
                "larger region."
            )


def drag_patch(
    mesh: Mesh,
    roi: I64,
    patch: I64,
    matrix: ArrayLike,
    level: float = 0.0,
    method: Method = "smooth",
    run: Run | None = None,
) -> Mesh:
    """Return the mesh with a patch moved by a similarity, the region around it following.

    It is `drag_patches` with one patch, the vertex ids `patch`, and its matrix (4, 4).
    """
    return drag_patches(mesh, roi, [(patch, matrix)], level, method, run)


def drag_patches(
    mesh: Mesh,
    roi: I64,
    motions: Sequence[Motion],
    level: float = 0.0,
    method: Method = "smooth",
    run: Run | None = None,
) -> Mesh:
    """Return the mesh with patches moved at once, each by its similarity, the region following.

    What does not depend on the matrices is kept in `run.memo`, so that the next call is one solve.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) vertex ids of the region; what is outside stays to the bit.
    motions : the ids of each patch, no id in two of them, and its (4, 4) similarity,
        x' = matrix @ (x, 1), mesh units.
    level : 0..1, at which the region bends; finer details are put back turned.
    method : see `PatchDrag.moved`.
    run : progress, cancel and memo.

    Raises
    ------
    RegionError
        The patches leave nothing of the region to bend.
    SketchError
        A matrix is no similarity that can be meant (see `checked_similarity`).
    SolveError
        The surface runs away from the patches.
    """
    run = run or Run()
    # Factors are large: only the newest is kept.
    prepared: Memo = run.memo.get("patch drags", lambda: Memo(1))
    patches = [patch for patch, _ in motions]
    patch = patches[0] if len(patches) == 1 else np.unique(np.concatenate(patches))
    key = (mesh.digest, roi.tobytes(), patch.tobytes(), level)
    drag = prepared.get(key, lambda: PatchDrag(mesh, roi, patch, level, run))
    return mesh.with_vertices(drag.moved(motions, method, run))


def checked_similarity(matrix: ArrayLike) -> F64:
    """Return the matrix as (4, 4) float64.

    Raises
    ------
    SketchError
        It is not finite, not affine, turns things inside out, or stretches without measure.
    """
    M = np.asarray(matrix, dtype=np.float64)
    if M.size != 16 or not np.isfinite(M).all():
        raise SketchError("The handle's matrix must be 16 finite numbers.")
    M = M.reshape(4, 4)
    stretch = np.linalg.svd(M[:3, :3], compute_uv=False)
    affine = bool((M[3] == (0.0, 0.0, 0.0, 1.0)).all())
    sane = np.linalg.det(M[:3, :3]) > 0 and stretch[0] <= _LARGEST_STRETCH
    if not affine or not sane or stretch[-1] < 1 / _LARGEST_STRETCH:
        raise SketchError(
            "The handle would be turned inside out or scaled beyond measure. Move it less far."
        )
    return M
