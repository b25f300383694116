"""Decomposition: base shape, modes, surface at k modes, level to k (Eqs. 11-16)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from engine.arrays import F64, I64
from engine.base import Rim
from engine.level import Curve
from engine.region import Region
from engine.solve import Factor

# Partial sums over the modes are kept at every so many: no slider step sums more than these.
CHUNK = 32


@dataclass(frozen=True, eq=False)
class Anchor:
    """A surface that is known whole, at a number of modes.

    Parameters
    ----------
    count : the number of modes.
    wave : its highest eigenvalue, 1 / mesh unit squared.
    surface, delta : (m, 3) positions and Laplacian coordinates.
    """

    count: int
    wave: float
    surface: F64
    delta: F64


@dataclass(frozen=True, eq=False)
class Decomposition:
    """A region as base shape plus modes plus the rest; everything in mesh units, nothing changes.

    Parameters
    ----------
    region : the region.
    factor : K_II, factorised (in the region's frame, where K is the same as outside).
    rim : the rule at the rim, "smooth" or "paper".
    base, original : (m, 3) positions of `roi`.
    areas : M_II, (m,).
    delta_base, delta_residual : (m, 3) Laplacian coordinates (Eqs. 9, 11).
    eigenvalues : (k,) ascending, 1 / mesh unit squared.
    modes : (m, k), M-orthonormal, column-contiguous; a prefix of what follows in the stream.
    eta : (k, 3) coefficients of the residual (Eq. 12).
    partial : surfaces at 0, CHUNK, 2 CHUNK ... modes.
    rest : surfaces beyond the modes, low-passed without modes (see `engine.lowpass`).
    curve : cutoff curvature by number of modes.
    complete : whether all that was asked for is there.
    report : what was done differently than usual, in plain words; "" when nothing.

    Notes
    -----
    Beyond the modes and the surfaces in `rest` what remains is one band, added in proportion: with
    k between two known surfaces `surface(k)` is on the straight line between them, so that the
    slider covers 0 to 1 without a jump and level 1 is the original to the last bit.
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
    partial: tuple[Anchor, ...]
    rest: tuple[Anchor, ...]
    curve: Curve
    complete: bool
    report: str = ""

    @property
    def roi(self) -> I64:
        """Ids of the vertices that move, (m,), ascending."""
        return self.region.roi

    @property
    def m(self) -> int:
        """Number of vertices that move; there are as many modes."""
        return len(self.base)

    @property
    def k(self) -> int:
        """Number of modes that are there."""
        return len(self.eigenvalues)

    def surface(self, k: int) -> F64:
        """Return the surface at k modes, (m, 3): base + sum_{i<k} phi_i eta_i / lambda_i.

        Since K phi = lambda M phi, this is what Eqs. 13-15 and the reconstruction of Eq. 6 give;
        no equations are solved.
        """
        if k >= self.m:
            return self.original
        if k > self.k:
            low, high, t = self._around(k)
            return low.surface + t * (high.surface - low.surface)
        anchor, part = self._chunk(k)
        return np.asarray(
            anchor.surface + self.modes[:, part] @ (self.eta[part] / self.eigenvalues[part, None])
        )

    def delta(self, k: int) -> F64:
        """Return the Laplacian coordinates of `surface(k)`, (m, 3) (Eq. 15)."""
        if k >= self.m:
            return self.delta_base + self.delta_residual
        if k > self.k:
            low, high, t = self._around(k)
            return low.delta + t * (high.delta - low.delta)
        anchor, part = self._chunk(k)
        return np.asarray(anchor.delta + self.modes[:, part] @ self.eta[part])

    def _chunk(self, k: int) -> tuple[Anchor, slice]:
        """Return the nearest partial sum below k modes and the modes that it lacks."""
        k = max(k, 0)
        anchor = self.partial[min(k // CHUNK, len(self.partial) - 1)]
        return anchor, slice(anchor.count, k)

    def _around(self, k: int) -> tuple[Anchor, Anchor, float]:
        """Return the known surfaces below and above k, and where k lies between them in 0..1."""
        delta = self.delta_base + self.delta_residual
        last = Anchor(self.m, np.inf, self.original, delta)
        known = [a for a in self.rest if a.count > self.k]
        above = next((a for a in known if a.count >= k), last)
        below = [a for a in known if a.count < k]
        low = below[-1] if below else Anchor(self.k, 0.0, self.surface(self.k), self.delta(self.k))
        return low, above, (k - low.count) / (above.count - low.count)

    def high(self, k: int) -> F64:
        """Return the Laplacian coordinates that `surface(k)` lacks, (m, 3) (Eq. 14)."""
        return self.delta_base + self.delta_residual - self.delta(k)

    def curvature(self, k: int) -> F64:
        """Return |H| of `surface(k)` at the roi, (m,), in 1 / mesh unit (Fig. 7)."""
        return np.asarray(np.linalg.norm(self.delta(k), axis=1) / 2)

    def cutoff(self, k: int) -> float:
        """Return the curvature below which 90 % of the area lies at k modes (Figs. 7, 8)."""
        return self.curve.cutoff(k)

    def mode_count(self, level: float) -> int:
        """Return how many modes the level 0..1 needs (Eq. 16): 0 for the base, m for all."""
        return self.curve.mode_count(level)

    def level_of(self, k: int) -> float:
        """Return the level that k modes reach (inverse of `mode_count`)."""
        return self.curve.level_of(k)

    def reaches(self, level: float) -> bool:
        """Return whether `mode_count(level)` and its surface are settled with what is there."""
        return self.curve.reaches(level)

    def wavelength(self, k: int) -> float:
        """Return the length of the smallest features that k modes hold, 2 pi / sqrt(lambda_k).

        In mesh units; infinite for the base. Beyond the computed modes lambda is taken to grow in
        proportion to k (Weyl's law).
        """
        counts, waves = self._spectrum()
        if k <= 0 or len(counts) == 1:
            return float("inf")
        wave = np.interp(k, counts, waves)
        if k > counts[-1]:
            wave = waves[-1] * k / counts[-1]
        return float(2 * np.pi / np.sqrt(wave))

    def mode_count_at(self, wavelength: float) -> int:
        """Return how many modes hold all features of at least this length, in mesh units."""
        if not wavelength > 0:
            return self.m
        counts, waves = self._spectrum()
        wave = (2 * np.pi / wavelength) ** 2
        if len(counts) == 1 or wave < waves[1]:
            return 0
        k = np.interp(wave, waves, counts)
        if wave > waves[-1]:
            k = counts[-1] * wave / waves[-1]
        return int(min(k, self.m))

    def _spectrum(self) -> tuple[F64, F64]:
        beyond = [a for a in self.rest if a.count > self.k]
        counts = np.concatenate([np.arange(self.k + 1.0), [a.count for a in beyond]])
        waves = np.concatenate([[0.0], self.eigenvalues, [a.wave for a in beyond]])
        return counts, waves

    def reconstruct(self, surface_edited: ArrayLike, turned_high: ArrayLike) -> F64:
        """Return the edited surface with its details: x' + K_II^-1 M_II (R delta_high) (Eq. 20).

        Parameters
        ----------
        surface_edited : (m, 3) the surface at the level, deformed.
        turned_high : (m, 3) `high(k)`, turned by the local rotations.
        """
        load = self.areas[:, None] * np.asarray(turned_high, dtype=np.float64)
        return np.asarray(np.asarray(surface_edited, dtype=np.float64) + self.factor.solve(load))
