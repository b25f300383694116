"""View: the camera as numbers. It projects points and gives the constraint rows of Eq. 17."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from engine.arrays import F64, frozen
from engine.errors import SketchError


@dataclass(frozen=True, eq=False)
class View:
    """The camera that a stroke was drawn through.

    Parameters
    ----------
    matrix : (4, 4) world to clip coordinates, row-major, so that `clip = matrix @ (x, y, z, 1)`.
    size : width and height of the viewport in logical pixels.

    Notes
    -----
    Pixels count from the top left corner, x to the right, y down; a point in the middle of the
    viewport projects to (width / 2, height / 2). Clip w grows with the distance from the eye.
    """

    matrix: F64
    size: tuple[float, float]

    def __post_init__(self) -> None:
        matrix = frozen(self.matrix, np.float64)
        width, height = (float(s) for s in self.size)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise SketchError("The view's matrix must be 4 by 4 finite numbers.")
        if not (width > 0 and height > 0 and np.isfinite(width * height)):
            raise SketchError("The view's width and height must be positive numbers of pixels.")
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "size", (width, height))

    @property
    def pixel_matrix(self) -> F64:
        """Rows P1, P2, P3 of the map to pixels, (3, 4): u = P1 x / P3 x and v = P2 x / P3 x."""
        width, height = self.size
        x, y, _, w = self.matrix
        return np.array([(x + w) * (width / 2), (w - y) * (height / 2), w])

    def project(self, points: ArrayLike) -> F64:
        """Return the pixel positions of `points` (p, 3) as (p, 2)."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        h = p @ self.pixel_matrix[:, :3].T + self.pixel_matrix[:, 3]
        return np.asarray(h[:, :2] / h[:, 2:])

    def depth(self, points: ArrayLike) -> F64:
        """Return clip w of `points` (p, 3) as (p,): positive in front of the eye."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        return np.asarray(p @ self.matrix[3, :3] + self.matrix[3, 3])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, View):
            return NotImplemented
        return self.size == other.size and bool((self.matrix == other.matrix).all())

    def __hash__(self) -> int:
        return hash((self.matrix.tobytes(), self.size))

    def to_json(self) -> dict[str, Any]:
        """Return plain lists and numbers."""
        return {"matrix": self.matrix.tolist(), "size": list(self.size)}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> View:
        """Build a view from what `to_json` gave."""
        width, height = data["size"]
        return cls(np.asarray(data["matrix"], dtype=np.float64), (width, height))


def look_at(
    target: ArrayLike,
    distance: float,
    azimuth: float,
    elevation: float,
    size: tuple[float, float],
    angle: float = 28.0,
) -> View:
    """Return the view of `target` (3,) from a direction given in degrees, z up, perspective.

    Azimuth 0 looks along +y (the front view) and grows as the eye goes to the right.
    """
    a, e = np.radians([azimuth, elevation])
    back = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    right = np.array([np.cos(a), np.sin(a), 0.0])
    up = np.cross(back, right)
    eye = np.asarray(target, dtype=np.float64) + distance * back
    steep = 1 / np.tan(np.radians(angle) / 2)
    frame = np.stack([right, up, back])
    seen = np.eye(4)
    seen[:3, :3] = frame
    seen[:3, 3] = -frame @ eye
    near, far = distance / 100, distance * 100
    lens = np.zeros((4, 4))
    lens[0, 0] = steep * size[1] / size[0]
    lens[1, 1] = steep
    lens[2, 2:] = (near + far) / (near - far), 2 * near * far / (near - far)
    lens[3, 2] = -1
    return View(lens @ seen, size)
