"""Details: what lies above a region's surface at a level, put back on it deformed (Eqs. 18-20).

Eq. 20 asks for the turned Laplacian coordinates of the details alone, L v' = R delta_high. Taken
literally it does harm twice. L^-1 holds positions at the rim and no slope, so details that turn
beside the rim fold it. And where the form turns at the features' own length, features and turns
multiply to loads that are nearly constant, which L^-1 makes into swells: features grow by half.
"""

from __future__ import annotations

import numpy as np

from engine.arrays import F64, I64
from engine.base import Plate
from engine.detail import Decomposition
from engine.rectify import turned

# From about this many times the features' own length on, they are turned as they stand. With less,
# heights are kept still better, but hollows that are as tight as features are high fold over.
REACH = 4.0


class Details:
    """The details of a region above its surface at k modes, ready to be put on it deformed.

    With h = x - x_k, delta = M^-1 K h and the local rotations R, the turning of the details adds

        v = argmin sum_j M_j |(M^-1 K v - (R - 1) delta)_j|^2 + s sum_i M_i |(v - (R - 1) h)_i|^2

    with j over the region and its rim, i over the region, v = 0 outside, and the final surface is
    x' + h + v. Rigid motions are met exactly by both sums. Shorter than the features, the first
    one rules and keeps their shape, as Eq. 20 does; longer, the second one keeps their height.

    Departure: the rule "paper" of the decomposition takes Eq. 20 as printed, with equality on the
    rows of the region, without rows of the rim and without s.

    Where the sums divide, s, follows from the features' own length.

    Parameters
    ----------
    parts : the region taken apart.
    k : number of modes that belong to the surface.

    Attributes
    ----------
    rows : (r,) which vertices of the patch it needs the rotations of, the region's first.

    Source: Orbay et al. 2012, Eqs. 18 to 20.
    """

    def __init__(self, parts: Decomposition, k: int) -> None:
        self._parts = parts
        self._none = k >= parts.m
        self._high = parts.high(k)
        self._offset = (parts.original - parts.surface(k)) / parts.region.scale
        region, self._plate = parts.region, None
        count = region.m
        if parts.rim == "smooth":
            count += len(region.rim)
            K = region.laplacian.stiffness
            self._bend: F64 = K[:count, : region.m] @ self._offset
            if not self._none:
                self._plate = Plate(region, stay=self._stay())
        self.rows: I64 = np.arange(count)

    def _stay(self) -> float:
        """Return s, 1 over the fourth power of the length / 2 pi that divides; 0 without features.

        (2 pi / length)^2 of the features is <delta, delta> / <h, delta>, integrated over the roi.
        """
        bend = self._bend[: len(self._offset)]
        work = float((bend * self._offset).sum())
        if not work > 0:
            return 0.0
        wave = float((bend**2 / self._parts.region.areas_roi[:, None]).sum()) / work
        return (wave / REACH**2) ** 2

    def turning(self, R: F64) -> F64:
        """Return what turning the details adds to the region's vertices, v (m, 3), mesh units.

        Parameters
        ----------
        R : (r, 3, 3) how the surface turned at `rows` (see `ring_rotations`).
        """
        parts = self._parts
        if self._none:
            return np.zeros_like(self._offset)
        if self._plate is None:
            high = self._high
            return parts.reconstruct(np.zeros_like(high), turned(R, high) - high)
        bend, offset = self._bend, self._offset
        v = self._plate.change(turned(R, bend) - bend, turned(R[: len(offset)], offset) - offset)
        return v * parts.region.scale
