"""Lines and dots that lie on the form: the rim, source curves, anchors, pins."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from app.look import rgb
from engine.arrays import F64, I64

_LIFT = -60.0  # steps of depth by which a line wins over the surface that it lies on


def smooth_curve(points: ArrayLike, closed: bool = False, samples: int = 8) -> F64:
    """Return a centripetal-free Catmull-Rom curve through `points` (p, 3), `samples` per span."""
    p = np.asarray(points, dtype=np.float64)
    if len(p) < 3:
        return p
    ends = (p[-1:], p[:1], p[1:2]) if closed else (2 * p[:1] - p[1:2], 2 * p[-1:] - p[-2:-1])
    knots = np.concatenate([ends[0], p, *ends[1:]])
    a, b, c, d = (knots[k : len(knots) - 3 + k, None, :] for k in range(4))
    t = (np.arange(samples) / samples)[None, :, None]
    span = 0.5 * (
        2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    )
    last = p[:1] if closed else p[-1:]
    return np.concatenate([span.reshape(-1, 3), last])


def _cells(connectivity: NDArray[Any], offsets: NDArray[Any]) -> vtkCellArray:
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(offsets, dtype=np.int64), deep=1),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(connectivity, dtype=np.int64), deep=1),
    )
    return cells


class Marks:
    """One actor of lines, or of dots, in one colour, of a width in pixels, on the form.

    Parameters
    ----------
    colour : "#rrggbb".
    width : of the line or the dot in device pixels.
    """

    def __init__(self, colour: str, width: float) -> None:
        self.data = vtkPolyData()
        self.mapper = vtkPolyDataMapper()
        self.mapper.SetInputData(self.data)
        self.mapper.ScalarVisibilityOff()
        self.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        self.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, _LIFT)
        self.mapper.SetRelativeCoincidentTopologyPointOffsetParameter(_LIFT)
        self.actor = vtkActor()
        self.actor.SetMapper(self.mapper)
        self.actor.PickableOff()
        look = self.actor.GetProperty()
        look.SetColor(*rgb(colour))
        look.SetLineWidth(width)
        look.SetPointSize(width)
        look.LightingOff()

    def tube(self) -> Marks:
        """Shade the line as a round tube and the dots as small balls; return the marks."""
        look = self.actor.GetProperty()
        look.LightingOn()
        look.SetAmbient(0.45)
        look.SetDiffuse(0.65)
        look.SetSpecular(0.2)
        look.SetRenderLinesAsTubes(True)
        look.SetRenderPointsAsSpheres(True)
        return self

    def line(self, points: NDArray[Any]) -> Marks:
        """Draw one line through `points` (p, 3), scene units; return the marks."""
        count = np.int64(len(points))
        return self._drawn(points, lines=_cells(np.arange(count), np.array([0, count])))

    def segments(self, points: NDArray[Any]) -> Marks:
        """Draw separate segments between `points` (2 s, 3); return the marks."""
        count = len(points)
        return self._drawn(
            points, lines=_cells(np.arange(count), np.arange(0, count + 1, 2, dtype=np.int64))
        )

    def dots(self, points: NDArray[Any]) -> Marks:
        """Draw a dot at each of `points` (p, 3); return the marks."""
        count = len(points)
        return self._drawn(
            points, dots=_cells(np.arange(count), np.arange(count + 1, dtype=np.int64))
        )

    def move(self, points: NDArray[Any]) -> None:
        """Give the same lines or dots other places."""
        self._place(points)

    def _drawn(
        self,
        points: NDArray[Any],
        lines: vtkCellArray | None = None,
        dots: vtkCellArray | None = None,
    ) -> Marks:
        self._place(points)
        if lines is not None:
            self.data.SetLines(lines)
        if dots is not None:
            self.data.SetVerts(dots)
        return self

    def _place(self, points: NDArray[Any]) -> None:
        places = vtkPoints()
        places.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float32), deep=1))
        self.data.SetPoints(places)


class Isoline:
    """Where a value given at vertices crosses one half: segments that follow a moving form.

    Parameters
    ----------
    values : (n,) at vertices.
    faces : (f, 3), those that may be crossed.
    """

    def __init__(self, values: NDArray[Any], faces: I64) -> None:
        above = values[faces] > 0.5
        crossed = faces[above.any(axis=1) & ~above.all(axis=1)]
        high = values[crossed] > 0.5
        lone_is_high = high.sum(axis=1) == 1
        lone = np.argmax(high == lone_is_high[:, None], axis=1)
        row = np.arange(len(crossed))
        start = crossed[row, lone]
        self._start = np.repeat(start, 2)
        self._end = np.stack(
            [crossed[row, (lone + 1) % 3], crossed[row, (lone + 2) % 3]], axis=1
        ).ravel()
        at_start, at_end = values[self._start], values[self._end]
        span = np.where(at_end == at_start, 1.0, at_end - at_start)
        self._share = ((0.5 - at_start) / span)[:, None]

    def points(self, positions: NDArray[Any]) -> NDArray[Any]:
        """Return the ends of the segments (2 s, 3) on a form at `positions` (n, 3)."""
        a, b = positions[self._start], positions[self._end]
        return np.asarray(a + self._share * (b - a))
