"""Decomposition: base shape, modes, surface at k modes, level to k (Eqs. 11-16)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from engine.arrays import F64, I64
from engine.base import Rim, base_shape
from engine.errors import EngineError
from engine.level import Curve
from engine.mesh import Mesh
from engine.region import Region
from engine.run import Run
from engine.solve import Factor, factorise
from engine.spectrum import DENSE_LIMIT, bands


@dataclass(frozen=True, eq=False)
class Decomposition:
    """A region as base shape plus modes plus the rest; everything in mesh units.

    Parameters
    ----------
    region : the region.
    factor : K_II, factorised.
    rim : the rule at the rim, "smooth" or "paper".
    base, original : (m, 3) positions of `roi`.
    areas : M_II, (m,).
    delta_base, delta_residual : (m, 3) Laplacian coordinates (Eqs. 9, 11).
    eigenvalues : (k,) ascending, 1 / mesh unit squared.
    modes : (m, k), M-orthonormal, column-contiguous.
    eta : (k, 3) coefficients of the residual (Eq. 12).
    """

    region: Region
    factor: Factor
    rim: Rim
    base: F64
    original: F64
    areas: F64
    delta_base: F64
    delta_residual: F64
    eigenvalues: F64
    modes: F64
    eta: F64
    curve: Curve
    complete: bool
    report: str = ""

    @property
    def roi(self) -> I64:
        """Ids of the vertices that move, (m,), ascending."""
        return self.region.roi

    @property
    def m(self) -> int:
        """Number of vertices that move."""
        return len(self.base)

    @property
    def k(self) -> int:
        """Number of modes that are there."""
        return len(self.eigenvalues)

    def surface(self, k: int) -> F64:
        """Return the surface at k modes, (m, 3): base + sum_{i<k} phi_i eta_i / lambda_i.

        Since K phi = lambda M phi this is what Eqs. 13-15 and the reconstruction of Eq. 6 give.
        """
        if k >= self.m:
            return self.original
        k = min(k, self.k)
        return np.asarray(
            self.base + self.modes[:, :k] @ (self.eta[:k] / self.eigenvalues[:k, None])
        )

    def delta(self, k: int) -> F64:
        """Return the Laplacian coordinates of `surface(k)`, (m, 3) (Eq. 15)."""
        if k >= self.m:
            return self.delta_base + self.delta_residual
        return np.asarray(self.delta_base + self.modes[:, :k] @ self.eta[:k])

    def high(self, k: int) -> F64:
        """Return the Laplacian coordinates that `surface(k)` lacks, (m, 3) (Eq. 14)."""
        return self.delta_base + self.delta_residual - self.delta(k)

    def curvature(self, k: int) -> F64:
        """Return |H| of `surface(k)` at the roi, (m,), in 1 / mesh unit (Fig. 7)."""
        return np.asarray(np.linalg.norm(self.delta(k), axis=1) / 2)

    def cutoff(self, k: int) -> float:
        """Return the curvature below which 90 % of the area lies at k modes (Fig. 7)."""
        return self.curve.cutoff(k)

    def mode_count(self, level: float) -> int:
        """Return how many modes the level 0..1 needs (Eq. 16): 0 for the base, m for all."""
        return self.curve.mode_count(level)

    def level_of(self, k: int) -> float:
        """Return the level that k modes reach (inverse of `mode_count`)."""
        return self.curve.level_of(k)

    def reaches(self, level: float) -> bool:
        """Return whether `mode_count(level)` and its surface are settled with the modes so far."""
        return self.curve.reaches(level)

    def reconstruct(self, surface_edited: ArrayLike, turned_high: ArrayLike) -> F64:
        """Return the edited surface with details, (m, 3): x' + K_II^-1 M_II (R delta_high) (Eq. 20).

        Parameters
        ----------
        surface_edited : (m, 3) the surface at the level, deformed.
        turned_high : (m, 3) `high(k)`, turned by the local rotations.
        """
        load = self.areas[:, None] * np.asarray(turned_high, dtype=np.float64)
        return np.asarray(np.asarray(surface_edited, dtype=np.float64) + self.factor.solve(load))


def decompose_stream(
    mesh: Mesh,
    roi: ArrayLike,
    modes: int | None = None,
    rim: Rim = "smooth",
    run: Run | None = None,
) -> Iterator[Decomposition]:
    """Yield the decomposition with the base and no modes first, then with more and more modes.

    Raises
    ------
    RegionError, SolveError, Cancelled
    """
    run = run or Run()
    if rim not in ("smooth", "paper"):
        raise EngineError(f"The rim rule {rim!r} is unknown. Use “smooth” or “paper”.")
    run.tick(0.0, "Base shape")
    region = Region(mesh, roi)
    factor = factorise(region.stiffness_roi)
    m, s = region.m, region.scale
    k = region.laplacian.stiffness[:m]
    local = base_shape(region, factor, rim)
    original = mesh.vertices[region.roi]
    offset = local - region.x[:m]
    areas = region.areas_roi
    delta_full = (k @ region.x) / areas[:, None] / s
    delta_residual = -(region.stiffness_roi @ offset) / areas[:, None] / s
    delta_base = delta_full - delta_residual
    curve = Curve.start(delta_base, delta_full, areas, m)
    wanted = min(m, default_modes(m) if modes is None else int(modes))
    last = Decomposition(
        region=region, factor=factor, rim=rim, base=original + offset * s, original=original,
        areas=areas * s * s, delta_base=delta_base, delta_residual=delta_residual,
        eigenvalues=np.zeros(0), modes=np.zeros((m, 0), order="F"), eta=np.zeros((0, 3)),
        curve=curve, complete=wanted == 0, report=region.laplacian.report,
    )  # fmt: skip
    yield last
    store = np.zeros((m, wanted), order="F")
    values, eta = np.zeros(wanted), np.zeros((wanted, 3))
    done = 0
    for lam, phi in bands(region.stiffness_roi, areas, wanted, run):
        b = len(lam)
        store[:, done : done + b] = phi / s
        values[done : done + b] = lam / s**2
        eta[done : done + b] = phi.T @ (areas[:, None] * delta_residual) * s
        curve = curve.extended(delta_base, store[:, : done + b], eta[: done + b], areas)
        done += b
        run.tick(done / max(wanted, 1), "Modes")
        last = Decomposition(
            region=region, factor=factor, rim=rim, base=last.base, original=original,
            areas=last.areas, delta_base=delta_base, delta_residual=delta_residual,
            eigenvalues=values[:done], modes=store[:, :done], eta=eta[:done],
            curve=curve, complete=done >= wanted, report=last.report,
        )  # fmt: skip
        yield last


def decompose(
    mesh: Mesh,
    roi: ArrayLike,
    modes: int | None = None,
    rim: Rim = "smooth",
    run: Run | None = None,
) -> Decomposition:
    """Return the last item of `decompose_stream`: the base shape and all modes wanted."""
    *_, last = decompose_stream(mesh, roi, modes, rim, run)
    return last


def decompose_until(
    mesh: Mesh, roi: ArrayLike, level: float, rim: Rim = "smooth", run: Run | None = None
) -> Decomposition:
    """Return the decomposition with just the modes that the level 0..1 needs (none for 0)."""
    for parts in decompose_stream(mesh, roi, None, rim, run):
        if parts.reaches(level):
            break
    return parts


def default_modes(m: int) -> int:
    """Return how many modes are computed unless told: all of a small region, else 100 to 500."""
    if m <= DENSE_LIMIT:
        return m
    return int(np.clip(10_000_000 // m, 100, 500))
