"""The form as VTK draws it: one actor whose positions, normals and colours are numpy arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse as sp
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from app.viewport.around import faces_about, renumbered
from engine.arrays import F64, I64, distinct
from engine.mesh import Mesh

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
_serials = count()


@dataclass(frozen=True, eq=False)
class Placement:
    """The map from mesh units to scene units: float32 keeps its digits, VTK its tolerances.

    A far-away or tiny model is moved to the origin and scaled to a diagonal of 64 to 128 units, by
    a power of two, so that nothing is rounded on the way back.

    Parameters
    ----------
    centre : (3,) in mesh units.
    scale : scene units in one mesh unit.
    """

    centre: F64
    scale: float

    @classmethod
    def of(cls, mesh: Mesh) -> Placement:
        """Return the placement that centres `mesh`."""
        diagonal = mesh.diagonal if mesh.diagonal > 0 else 1.0
        return cls(mesh.bounds.mean(axis=0), 2.0 ** (6 - np.floor(np.log2(diagonal))))

    def to_scene(self, points: ArrayLike) -> F64:
        """Return mesh positions (..., 3) in scene units."""
        return np.asarray((np.asarray(points, dtype=np.float64) - self.centre) * self.scale)

    def to_mesh(self, points: ArrayLike) -> F64:
        """Return scene positions (..., 3) in mesh units."""
        return np.asarray(np.asarray(points, dtype=np.float64) / self.scale + self.centre)

    @cached_property
    def matrix(self) -> F64:
        """The map as (4, 4): scene = matrix @ (x, y, z, 1)."""
        m = np.eye(4) * self.scale
        m[:3, 3] = -self.scale * self.centre
        m[3, 3] = 1.0
        return m


def summed_at_corners(faces: I64, values: NDArray[Any], n: int) -> NDArray[Any]:
    """Return the sum of `values` (f, c) over the faces around each of `n` vertices, (n, c)."""
    corners = faces.ravel()
    columns = [
        np.bincount(corners, weights=np.repeat(values[:, c], 3), minlength=n)
        for c in range(values.shape[1])
    ]
    return np.stack(columns, axis=1)


def unit_normals(positions: NDArray[Any], faces: I64, n: int) -> F32:
    """Return area-weighted unit normals (n, 3) of `faces`; zero where no face has an area."""
    a, b, c = (positions[faces[:, k]] for k in range(3))
    summed = summed_at_corners(faces, np.cross(b - a, c - a), n)
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    normals = np.divide(summed, length, out=np.zeros(summed.shape), where=length > 0)
    return normals.astype(np.float32)


def _farthest(positions: NDArray[Any]) -> float:
    return max(float(positions.max()), -float(positions.min())) if positions.size else 0.0


def _owned(array: NDArray[Any]) -> F32:
    """Return an array as VTK reads it and we write it, itself if it is so; else a copy."""
    return np.require(array, np.float32, ["C_CONTIGUOUS", "WRITEABLE", "OWNDATA"])


def offsets_of(faces: I64) -> I64:
    """Return where VTK finds the corners of each of the faces (f, 3), and their end, (f + 1,)."""
    return np.arange(0, 3 * len(faces) + 1, 3, dtype=np.int64)


class _Neighbourhood:
    """Which normals change when the vertices `ids` move, and the faces that give them."""

    def __init__(self, ids: I64, faces: I64, incidence: sp.csr_array) -> None:
        self.ids = ids
        n = incidence.shape[0]
        self.ring = distinct(faces[faces_about(ids, incidence)], n)
        touching = faces[faces_about(self.ring, incidence)]
        self.used = distinct(touching, n)
        self.faces = renumbered(touching, self.used, n)
        self.ring_local = renumbered(self.ring, self.used, n)

    def normals(self, positions: NDArray[Any]) -> F32:
        """Return the unit normals of the ring, (r, 3)."""
        return unit_normals(positions[self.used], self.faces, len(self.used))[self.ring_local]


@dataclass(frozen=True, eq=False)
class Moved:
    """A surface of which some vertices have moved, ready to be taken.

    Parameters
    ----------
    stamp : of the surface before.
    positions, normals : (n, 3), nobody else's.
    reach : how far from the origin it has been along an axis.
    about : what changes when these vertices move.
    """

    stamp: tuple[int, int]
    positions: F32
    normals: F32
    reach: float
    about: _Neighbourhood


class Surface:
    """One triangle surface on screen.

    Parameters
    ----------
    positions : (n, 3) in scene units; float32 ones that can be written are taken, not copied.
    faces : (f, 3).
    colour : (3,) uint8, of every vertex at first.
    normals : (n, 3), if they are known already; taken likewise.
    incidence : (n, f), which faces are around a vertex; needed to move only some of them.
    offsets : (f + 1,) what `offsets_of` gives, if it is known already.

    Attributes
    ----------
    positions, normals : (n, 3) float32, colours : (n, 3) uint8; the arrays VTK itself reads.
    actor : the vtkActor to put into a renderer.
    """

    def __init__(
        self,
        positions: NDArray[Any],
        faces: I64,
        colour: ArrayLike,
        normals: F32 | None = None,
        incidence: sp.csr_array | None = None,
        offsets: I64 | None = None,
    ) -> None:
        n = len(positions)
        self._serial, self._moves, self._coats = next(_serials), 0, 0
        self._incidence = incidence
        self.faces = faces
        self.positions: F32 = _owned(positions)
        self.normals: F32 = _owned(
            unit_normals(self.positions, faces, n) if normals is None else normals
        )
        self.colours: U8 = np.empty((n, 3), dtype=np.uint8)
        self._neighbourhood: _Neighbourhood | None = None
        self._reach = _farthest(self.positions)

        self._points = vtkPoints()
        self._points.SetData(numpy_to_vtk(self.positions))
        self._normals = numpy_to_vtk(self.normals)
        self._normals.SetName("Normals")
        self._rgb = numpy_to_vtk(self.colours)
        self._rgb.SetName("rgb")
        self.recolour(np.asarray(colour, dtype=np.uint8))
        self._connectivity = np.ascontiguousarray(faces, dtype=np.int64).reshape(-1)
        self._offsets = offsets_of(faces) if offsets is None else offsets
        cells = vtkCellArray()
        cells.SetData(
            numpy_to_vtkIdTypeArray(self._offsets), numpy_to_vtkIdTypeArray(self._connectivity)
        )
        self.data = vtkPolyData()
        self.data.SetPoints(self._points)
        self.data.SetPolys(cells)
        self.data.GetPointData().SetNormals(self._normals)
        self.data.GetPointData().SetScalars(self._rgb)

        self.mapper = vtkPolyDataMapper()
        self.mapper.SetInputData(self.data)
        self.mapper.SetColorModeToDirectScalars()
        self.mapper.SetScalarModeToUsePointData()
        self.mapper.ScalarVisibilityOn()
        self.actor = vtkActor()
        self.actor.SetMapper(self.mapper)

    @property
    def reach(self) -> float:
        """How far from the origin it has been along an axis, at the most, scene units."""
        return self._reach

    @property
    def n(self) -> int:
        """Number of vertices."""
        return len(self.positions)

    def move(self, positions: NDArray[Any], ids: I64 | None = None) -> I64 | None:
        """Take new positions in scene units: of all vertices (n, 3), or of `ids` only (m, 3).

        Returns the vertices whose positions or normals are others now, None for all.
        """
        self._reach = max(self._reach, _farthest(positions))
        if ids is None:
            self.positions[:] = positions
            self.normals[:] = unit_normals(self.positions, self.faces, self.n)
            ring = None
        else:
            self.positions[ids] = positions
            if self._neighbourhood is None or self._neighbourhood.ids is not ids:
                assert self._incidence is not None
                self._neighbourhood = _Neighbourhood(ids, self.faces, self._incidence)
            ring = self._neighbourhood.ring
            self.normals[ring] = self._neighbourhood.normals(self.positions)
        self.moved()
        return ring

    def moved_to(self, positions: NDArray[Any], ids: I64) -> Moved:
        """Return what `move` would make of vertices `ids` at new positions (m, 3); in any thread.

        It holds only as long as the surface has the same stamp.
        """
        assert self._incidence is not None
        stamp = self.stamp
        here, normals = self.positions.copy(), self.normals.copy()
        here[ids] = positions
        about = _Neighbourhood(ids, self.faces, self._incidence)
        normals[about.ring] = about.normals(here)
        return Moved(stamp, here, normals, max(self._reach, _farthest(positions)), about)

    def take(self, made: Moved) -> None:
        """Take the arrays of `moved_to` for its own."""
        self.positions, self.normals, self._reach = made.positions, made.normals, made.reach
        self._neighbourhood = made.about
        self._points.SetData(numpy_to_vtk(self.positions))
        self._normals = numpy_to_vtk(self.normals)
        self._normals.SetName("Normals")
        self.data.GetPointData().SetNormals(self._normals)
        self.moved()

    def moved(self) -> None:
        """Tell VTK that positions and normals were written in place."""
        self._moves += 1
        self._points.GetData().Modified()
        self._points.Modified()
        self._normals.Modified()

    def recoloured(self) -> None:
        """Tell VTK that colours were written in place."""
        self._coats += 1
        self._rgb.Modified()

    def recolour(self, colours: NDArray[Any], ids: I64 | None = None) -> None:
        """Take new colours (n, 3) uint8, of all vertices or of `ids` only; or one (3,) for all."""
        if np.ndim(colours) == 1:
            for k in range(3):  # numpy repeats a row of three bytes ten times slower
                self.colours[:, k] = colours[k]
        else:
            self.colours[slice(None) if ids is None else ids] = colours
        self.recoloured()

    @property
    def stamp(self) -> tuple[int, int]:
        """A pair of numbers that no other surface has, nor this one with other positions."""
        return (self._serial, self._moves)

    @property
    def coat(self) -> tuple[int, int]:
        """A pair of numbers that no other surface has, nor this one with other colours."""
        return (self._serial, self._coats)
