"""The plane of symmetry: a quiet line around the form, and a sheet of glass where it is chosen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from app.look import Theme, rgb
from app.viewport.curves import Isoline, Segments, cells, places
from engine.arrays import F64, I64

LINE_PX = 1.5
OPACITY = 0.14
ROOM = 1.12  # the sheet is so much larger than the form


class PlaneMark:
    """Where a plane cuts the form, and the plane itself as a translucent sheet.

    Parameters
    ----------
    plane : a, b, c, d in scene units, a x + b y + c z = d, with a unit normal.
    positions : (n, 3) of the form, scene units.
    faces : (f, 3) of the form.
    scale : device pixels in a logical one.
    """

    def __init__(
        self, plane: F64, positions: NDArray[Any], faces: I64, theme: Theme, scale: float
    ) -> None:
        away = positions @ plane[:3] - plane[3]
        self._line = Isoline(away + 0.5, faces)
        self._segments = Segments(theme.halo, LINE_PX * scale, self._line.points(positions))
        self.line = self._segments.actor
        self.sheet = _sheet(plane, positions, theme)

    def follow(self, positions: NDArray[Any]) -> None:
        """Lay the line on the form at `positions` (n, 3), scene units."""
        self._segments.move(self._line.points(positions))


def _sheet(plane: F64, positions: NDArray[Any], theme: Theme) -> vtkActor:
    """Return a translucent rectangle in the plane, somewhat larger than the form's box."""
    normal = plane[:3]
    across = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(normal, across)
    u = u / np.linalg.norm(u)
    v = np.cross(normal, u)
    # Column by column: along the long axis numpy takes twenty times as long.
    columns = [positions[:, k] for k in range(3)]
    low = np.array([column.min() for column in columns])
    high = np.array([column.max() for column in columns])
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                        for z in (low[2], high[2])])  # fmt: skip
    middle = (low + high) / 2
    middle = middle - (middle @ normal - plane[3]) * normal
    reach = [ROOM * float(np.abs((corners - middle) @ way).max()) for way in (u, v)]
    ends = [middle + a * reach[0] * u + b * reach[1] * v for a, b in
            ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
    data = vtkPolyData()
    data.SetPoints(places(np.array(ends)))
    data.SetPolys(cells(np.arange(4), np.array([0, 4])))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.PickableOff()
    look = actor.GetProperty()
    look.SetColor(*rgb(theme.text))
    look.SetOpacity(OPACITY)
    look.LightingOff()
    look.EdgeVisibilityOn()
    look.SetEdgeColor(*rgb(theme.text))
    look.SetEdgeOpacity(0.5)
    return actor
