"""Lines and dots that lie on the form: the rim, source curves, anchors, pins."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from app.look import rgb
from engine.arrays import F64, I64


def smooth_curve(points: ArrayLike, closed: bool = False, samples: int = 8) -> F64:
    """Return a Catmull-Rom curve through `points` (p, 3), `samples` per span."""
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


def cells(connectivity: NDArray[Any], offsets: NDArray[Any]) -> vtkCellArray:
    """Return VTK's cells: the ids of their corners, and where each one's begin."""
    made = vtkCellArray()
    made.SetData(
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(offsets, dtype=np.int64), deep=1),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(connectivity, dtype=np.int64), deep=1),
    )
    return made


def places(points: NDArray[Any]) -> vtkPoints:
    """Return points (p, 3) as VTK's."""
    made = vtkPoints()
    made.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float32), deep=1))
    return made


def _on_top(mapper: vtkPolyDataMapper, steps: float) -> None:
    """Let what `mapper` draws win over a surface that it lies on, by some steps of depth."""
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -steps)
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, -steps)


class Segments:
    """Flat line segments of a width in device pixels, on the form."""

    def __init__(self, colour: str, width: float, points: NDArray[Any]) -> None:
        count = len(points)
        self._data = vtkPolyData()
        self._data.SetLines(cells(np.arange(count), np.arange(0, count + 1, 2)))
        self.move(points)
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        _on_top(mapper, 60.0)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        look = self.actor.GetProperty()
        look.SetColor(*rgb(colour))
        look.SetLineWidth(width)
        look.LightingOff()

    def move(self, points: NDArray[Any]) -> None:
        """Put the ends of the segments at `points` (2 s, 3), scene units."""
        self._data.SetPoints(places(points))


class Solid:
    """A tube along a line, or a ball at each point: its thickness stays the same on screen.

    Real triangles, rebuilt whenever the camera moves: they are few, they are lit like the form, and
    they do not depend on what a driver makes of wide lines and large points.

    Parameters
    ----------
    colour : "#rrggbb".
    width : diameter in logical pixels.
    points : (p, 3) scene units.
    tube : a tube through the points, else a ball at each.
    lift : towards the eye, in pixels, so that one mark shows above another.
    """

    def __init__(
        self, colour: str, width: float, points: NDArray[Any], tube: bool, lift: float = 0.0
    ) -> None:
        self._points = np.asarray(points, dtype=np.float64)
        self._radius = width / 2
        self._lift = lift
        self._around, faces = _tube(self._points) if tube else _balls(self._points)
        self._data = vtkPolyData()
        self._data.SetPolys(cells(faces.ravel(), np.arange(0, faces.size + 1, 3)))
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._data)
        _on_top(mapper, 40.0)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        look = self.actor.GetProperty()
        look.SetColor(*rgb(colour))
        look.SetInterpolationToPhong()
        look.SetAmbient(0.5)
        look.SetDiffuse(0.6)
        look.SetSpecular(0.15)
        look.SetSpecularPower(20)

    def resize(self, toward_eye: F64, unit: F64) -> None:
        """Give it its thickness on screen.

        Parameters
        ----------
        toward_eye : (p, 3) unit vectors from the points to the eye.
        unit : (p,) scene units in one logical pixel at the points.
        """
        centre = self._points + self._lift * unit[:, None] * toward_eye
        ring = self._around * (self._radius * unit)[:, None, None]
        self._data.SetPoints(places((centre[:, None, :] + ring).reshape(-1, 3)))
        normals = numpy_to_vtk(self._around.reshape(-1, 3).astype(np.float32), deep=1)
        self._data.GetPointData().SetNormals(normals)

    @property
    def points(self) -> F64:
        """Where it is, (p, 3), scene units."""
        return self._points


_SIDES = 12


def _tube(points: F64) -> tuple[F64, I64]:
    """Return unit offsets (p, s, 3) of rings about a line, and the triangles between them."""
    along = np.gradient(points, axis=0) if len(points) > 1 else np.array([[0.0, 0.0, 1.0]])
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.divide(
        along, length, out=np.tile([0.0, 0.0, 1.0], (len(points), 1)), where=length > 0
    )
    side = _transported(along)
    up = np.cross(along, side)
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    around = (
        np.cos(angle)[None, :, None] * side[:, None, :]
        + np.sin(angle)[None, :, None] * up[:, None, :]
    )
    k = np.arange(len(points) - 1)[:, None] * _SIDES
    a, b = np.arange(_SIDES)[None, :], (np.arange(_SIDES)[None, :] + 1) % _SIDES
    quads = np.stack([k + a, k + _SIDES + a, k + _SIDES + b, k + b], axis=-1).reshape(-1, 4)
    return around, np.concatenate([quads[:, [0, 2, 1]], quads[:, [0, 3, 2]]])


def _transported(along: F64) -> F64:
    """Return a unit vector across each tangent that does not twist along the line."""
    # What all tangents are far from is across each of them; only a line that turns every way needs
    # its vector carried from point to point.
    away = np.linalg.eigh(along.T @ along)[1][:, 0]
    across = away - (along @ away)[:, None] * along
    length = np.linalg.norm(across, axis=1, keepdims=True)
    if length.min() > 0.5:
        return np.asarray(across / length)
    first = np.eye(3)[np.argmin(np.abs(along[0]))]
    for k, tangent in enumerate(along):
        first = first - (first @ tangent) * tangent
        first = first / (np.linalg.norm(first) or 1.0)
        across[k] = first
    return across


def _balls(points: F64) -> tuple[F64, I64]:
    """Return unit offsets (p, s, 3) of a ball at each point, and its triangles."""
    ball, faces = _ball()
    all_faces = faces[None] + (np.arange(len(points)) * len(ball))[:, None, None]
    return np.broadcast_to(ball, (len(points), *ball.shape)), all_faces.reshape(-1, 3)


@cache
def _ball() -> tuple[F64, I64]:
    """Return the vertices (s, 3) of a ball of radius 1, and its triangles."""
    rings, sides = 7, 12
    polar = np.pi * (np.arange(rings) + 0.5) / rings
    angle = 2 * np.pi * np.arange(sides) / sides
    ball = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)).ravel(),
            np.outer(np.sin(polar), np.sin(angle)).ravel(),
            np.repeat(np.cos(polar), sides),
        ],
        axis=1,
    )
    ball = np.concatenate([ball, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    k, a = np.meshgrid(np.arange(rings - 1) * sides, np.arange(sides), indexing="ij")
    b = (a + 1) % sides
    quads = np.stack([k + a, k + sides + a, k + sides + b, k + b], axis=-1).reshape(-1, 4)
    turn = (np.arange(sides) + 1) % sides
    last = (rings - 1) * sides
    top = np.stack([np.full(sides, rings * sides), np.arange(sides), turn], axis=1)
    bottom = np.stack(
        [np.full(sides, rings * sides + 1), last + turn, last + np.arange(sides)], axis=1
    )
    return ball, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], top, bottom])


class Isoline:
    """Where a value given at vertices crosses one half: segments that follow a moving form.

    Parameters
    ----------
    values : (n,) at vertices.
    faces : (f, 3), those that may be crossed.
    """

    def __init__(self, values: NDArray[Any], faces: I64) -> None:
        above = values > 0.5
        a, b, c = (above[faces[:, k]] for k in range(3))
        crossed = faces[(a != b) | (b != c)]
        high = above[crossed]
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

    def __len__(self) -> int:
        """Number of segments."""
        return len(self._start) // 2

    def points(self, positions: NDArray[Any]) -> NDArray[Any]:
        """Return the ends of the segments (2 s, 3) on a form at `positions` (n, 3)."""
        a, b = positions[self._start], positions[self._end]
        return np.asarray(a + self._share * (b - a))
