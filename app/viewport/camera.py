"""Our own camera on top of vtkCamera: orbit, pan and zoom around a point, views, and flights.

The camera is a frozen `Eye`; every movement returns another one. Nothing rolls: the up axis stays
upright, except when one looks straight along it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engine.arrays import F64

FIELD_OF_VIEW = 28.0
HALF_STEEPNESS = math.tan(math.radians(FIELD_OF_VIEW / 2))
_FARTHEST = 1e6
_NEAREST = 1e-5


def box(points: NDArray[Any]) -> tuple[F64, F64]:
    """Return the lowest and the highest corner of the box about `points` (p, 3).

    Column by column: along the long axis numpy takes twenty times as long.
    """
    columns = [points[:, k] for k in range(3)]
    low, high = ([float(f(c)) for c in columns] for f in (np.min, np.max))
    return np.array(low), np.array(high)


@dataclass(frozen=True, eq=False)
class Eye:
    """Where one looks from, in scene coordinates.

    Parameters
    ----------
    centre : (3,) the point in the middle of the picture.
    distance : from `centre` to the eye.
    azimuth : angle about the up axis in radians; 0 looks along +y, the front view.
    elevation : angle above the horizon in radians, in -pi/2..pi/2.
    perspective : else orthographic, with the same size at `centre`.
    up : index of the up axis, 2 for z, 1 for y.
    """

    centre: F64
    distance: float
    azimuth: float = math.radians(35.0)
    elevation: float = math.radians(22.0)
    perspective: bool = True
    up: int = 2

    @property
    def axes(self) -> F64:
        """Right, up and backward (towards the eye) as rows of a (3, 3) rotation."""
        ca, sa = math.cos(self.azimuth), math.sin(self.azimuth)
        ce, se = math.cos(self.elevation), math.sin(self.elevation)
        rows = np.array([[ca, sa, 0.0], [-se * sa, se * ca, ce], [ce * sa, -ce * ca, se]])
        if self.up == 1:
            # y up: x stays, z takes the place of -y, so that the front view looks along -z.
            rows = np.stack([rows[:, 0], rows[:, 2], -rows[:, 1]], axis=1)
        return rows

    @property
    def position(self) -> F64:
        """The eye itself, (3,)."""
        return np.asarray(self.centre + self.distance * self.axes[2])

    @property
    def half_height(self) -> float:
        """Half the height of what is seen at `centre`, in scene units."""
        return self.distance * HALF_STEEPNESS

    def unit_per_pixel(self, points: F64, height: float) -> F64:
        """Return the scene units in one pixel at each of `points` (p, 3), as (p,).

        Parameters
        ----------
        height : of the viewport in pixels.
        """
        unit = 2 * self.half_height / height
        if not self.perspective:
            return np.full(len(points), unit)
        depth = (self.position - points) @ self.axes[2]
        return np.asarray(unit * np.maximum(depth, 1e-6) / self.distance)

    def toward(self, points: F64) -> F64:
        """Return the unit vectors from `points` (p, 3) to the eye."""
        if not self.perspective:
            return np.broadcast_to(self.axes[2], points.shape)
        there = self.position - points
        return np.asarray(there / np.maximum(np.linalg.norm(there, axis=1, keepdims=True), 1e-12))

    def orbited(self, pivot: ArrayLike, azimuth: float, elevation: float) -> Eye:
        """Return the eye turned by two angles (radians), `pivot` keeping its place on screen."""
        p = np.asarray(pivot, dtype=np.float64)
        limit = math.pi / 2
        turned = replace(
            self,
            azimuth=math.remainder(self.azimuth + azimuth, 2 * math.pi),
            elevation=min(limit, max(-limit, self.elevation + elevation)),
        )
        rotation = turned.axes.T @ self.axes
        return replace(turned, centre=p + rotation @ (self.centre - p))

    def panned(self, right: float, up: float) -> Eye:
        """Return the eye moved so that the picture moves by (right, up) scene units."""
        axes = self.axes
        return replace(self, centre=self.centre - right * axes[0] - up * axes[1])

    def zoomed(self, pivot: ArrayLike, factor: float) -> Eye:
        """Return the eye with everything `factor` times larger, `pivot` keeping its place."""
        p = np.asarray(pivot, dtype=np.float64)
        distance = min(_FARTHEST, max(_NEAREST, self.distance / factor))
        scale = distance / self.distance
        return replace(self, distance=distance, centre=p + scale * (self.centre - p))

    def framing(self, points: NDArray[Any], aspect: float, margin: float = 1.12) -> Eye:
        """Return the eye in the same direction with `points` (p, 3) filling the picture.

        Parameters
        ----------
        aspect : width over height of the viewport.
        """
        low, high = box(points)
        corners = np.array(
            [
                [x, y, z]
                for x in (low[0], high[0])
                for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
        )
        seen = (points if len(points) < 100_000 else corners) @ self.axes.T
        least, most = seen.min(axis=0), seen.max(axis=0)
        middle = (least + most) / 2
        half = (most - least) / 2
        size = max(half[1], half[0] / aspect, 1e-6 * max(1.0, float(np.abs(middle).max())))
        depth = half[2] if self.perspective else 0.0
        return replace(
            self,
            centre=self.axes.T @ middle,
            distance=min(_FARTHEST, max(_NEAREST, margin * size / HALF_STEEPNESS + depth)),
        )

    def towards(self, other: Eye, share: float) -> Eye:
        """Return the eye on the way to `other`; `share` 0 is here, 1 is there."""
        turn = math.remainder(other.azimuth - self.azimuth, 2 * math.pi)
        return replace(
            other,
            centre=self.centre + share * (other.centre - self.centre),
            distance=self.distance * (other.distance / self.distance) ** share,
            azimuth=self.azimuth + share * turn,
            elevation=self.elevation + share * (other.elevation - self.elevation),
        )

    def same_as(self, other: Eye) -> bool:
        """Whether both give the same picture."""
        return bool((self.centre == other.centre).all()) and (
            self.distance,
            self.azimuth,
            self.elevation,
            self.perspective,
            self.up,
        ) == (other.distance, other.azimuth, other.elevation, other.perspective, other.up)

    def apply(self, camera: Any, radius: float) -> None:
        """Put a vtkCamera where this eye is.

        Parameters
        ----------
        radius : of the sphere about the scene's origin that holds everything drawn.
        """
        axes = self.axes
        camera.SetFocalPoint(*self.centre)
        camera.SetPosition(*self.position)
        camera.SetViewUp(*axes[1])
        camera.SetViewAngle(FIELD_OF_VIEW)
        camera.SetParallelProjection(not self.perspective)
        camera.SetParallelScale(self.half_height)
        along = float(self.position @ axes[2])
        far = along + radius
        near = along - radius
        if self.perspective:
            # 24 bits of depth resolve far / near up to some thousands well.
            far = max(far, 1e-3 * self.distance)
            near = max(near, far / 5000, 1e-6)
        camera.SetClippingRange(near, max(far, near * 1.001 if near > 0 else near + radius))


#: Directions by name: azimuth and elevation in degrees.
STANDARD_VIEWS = {
    "front": (0.0, 0.0),
    "back": (180.0, 0.0),
    "right": (90.0, 0.0),
    "left": (-90.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
    "three-quarter": (35.0, 22.0),
}
