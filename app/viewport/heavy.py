"""What a heavy form needs before it can be shown: worked out once, best in the engine's thread."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy import sparse as sp

from app.viewport.surface import Placement, offsets_of
from engine.arrays import F64, I64
from engine.mesh import Mesh, Topology

F32 = NDArray[np.float32]
HEAVY_FACES = 150_000
PIECE_FACES = 100_000  # 10 ms of a processor that draws them
CELLS_ACROSS = 128


@dataclass(frozen=True, eq=False)
class Part:
    """Some of the faces, for a piece of the form that is drawn by itself.

    Parameters
    ----------
    ids : (v,) the vertices that they use.
    faces : (f, 3) in positions of `ids`.
    of : (f,) which faces of the form they are.
    """

    ids: I64
    faces: I64
    of: I64


@dataclass(frozen=True, eq=False)
class Lighter:
    """A form with far fewer faces: its vertices clustered on a grid.

    Parameters
    ----------
    ids : (c,) a vertex of the form for each occupied cell.
    faces : (g, 3) in positions of `ids`.
    cell : (n,) the cell of each vertex of the form.
    face : (f,) which of `faces` each face of the form became, -1 for none.
    count : (g,) how many became each of `faces`.
    """

    ids: I64
    faces: I64
    cell: I64
    face: I64
    count: I64


@dataclass(frozen=True, eq=False)
class Heavy:
    """A heavy form's lighter form, and the parts that it is drawn in.

    Parameters
    ----------
    numbers : which face of the form each face of all parts is; the last is -1, for none.
    offsets : (f + 1,) what VTK wants to know of the faces.
    """

    lighter: Lighter
    parts: tuple[Part, ...]
    numbers: NDArray[np.int32]
    offsets: I64


@dataclass(frozen=True, eq=False)
class Placed:
    """Where a heavy mesh lies in the scene, (n, 3), and its unit normals there."""

    positions: F32
    normals: F32


@dataclass(frozen=True, eq=False)
class Own:
    """Arrays of a heavy mesh that whoever shows it may write into.

    Parameters
    ----------
    vertices : (n, 3) mesh units.
    positions, normals : (n, 3) in the scene.
    """

    vertices: F64
    positions: F32
    normals: F32


_known: WeakKeyDictionary[Topology, Heavy] = WeakKeyDictionary()
_placed: WeakKeyDictionary[Mesh, Placed] = WeakKeyDictionary()
_own: WeakKeyDictionary[Mesh, Own] = WeakKeyDictionary()


def is_heavy(mesh: Mesh) -> bool:
    """Whether a processor that draws needs more than a moment for a mesh."""
    return len(mesh.faces) > HEAVY_FACES


def prepare(mesh: Mesh) -> None:
    """Work out what showing `mesh` will need, so that the window has it at hand."""
    mesh.digest, mesh.diagonal  # noqa: B018 (kept by the mesh)
    topology = mesh.topology
    topology.incidence, topology.adjacency, topology.components  # noqa: B018
    if is_heavy(mesh):
        heavy(mesh)
        _own[mesh] = _copied(mesh)


def heavy(mesh: Mesh) -> Heavy:
    """Return what a heavy form needs; kept as long as its faces are."""
    known = _known.get(mesh.topology)
    if known is None:
        positions = (mesh.vertices - mesh.bounds.mean(axis=0)).astype(np.float32)
        parts = parts_of(positions, mesh.faces)
        numbers = np.concatenate([*(part.of for part in parts), [-1]]).astype(np.int32)
        lighter = lightened(positions, mesh.faces)
        known = Heavy(lighter, parts, numbers, offsets_of(mesh.faces))
        _known[mesh.topology] = known
    return known


def placed(mesh: Mesh) -> Placed:
    """Return a heavy mesh as it lies in the scene; kept as long as the mesh is."""
    known = _placed.get(mesh)
    if known is None:
        positions = Placement.of(mesh).to_scene(mesh.vertices).astype(np.float32)
        known = Placed(positions, normals_of(positions, mesh.faces, mesh.topology.incidence))
        _placed[mesh] = known
    return known


def own(mesh: Mesh) -> Own:
    """Return arrays of a heavy mesh for one who shows it: those prepared, or else copies."""
    ready = _own.pop(mesh, None)
    return _copied(mesh) if ready is None else ready


def _copied(mesh: Mesh) -> Own:
    there = placed(mesh)
    return Own(mesh.vertices.copy(), there.positions.copy(), there.normals.copy())


def normals_of(positions: F32, faces: I64, incidence: sp.csr_array) -> F32:
    """Return area-weighted unit normals (n, 3); zero where no face has an area."""
    a, b, c = (positions[faces[:, k]] for k in range(3))
    summed = np.asarray(incidence @ np.cross(b - a, c - a))
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    normals = np.divide(summed, length, out=np.zeros_like(summed), where=length > 0)
    return np.asarray(normals, dtype=np.float32)


def lightened(positions: NDArray[np.floating], faces: I64, cells: int = CELLS_ACROSS) -> Lighter:
    """Return a form with one vertex for each occupied cell of a grid, `cells` across.

    Rossignac and Borrel's vertex clustering. The vertices that remain are vertices of the form, so
    that colours and normals are looked up, not computed.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    step = float((high - low).max()) / cells or 1.0
    at = ((positions - low) / step).astype(np.int64)
    key = (at[:, 0] * (cells + 2) + at[:, 1]) * (cells + 2) + at[:, 2]
    _, first, cell = np.unique(key, return_index=True, return_inverse=True)
    small = cell[faces]
    proper = np.flatnonzero(
        (small[:, 0] != small[:, 1]) & (small[:, 1] != small[:, 2]) & (small[:, 2] != small[:, 0])
    )
    turned = small[proper]
    row, least = np.arange(len(turned))[:, None], np.argmin(turned, axis=1)[:, None]
    turned = turned[row, (least + np.arange(3)) % 3]
    n = len(first)
    keys = (turned[:, 0] * n + turned[:, 1]) * n + turned[:, 2]
    _, once, became = np.unique(keys, return_index=True, return_inverse=True)
    face = np.full(len(faces), -1, dtype=np.int64)
    face[proper] = became
    count = np.bincount(became, minlength=len(once))
    return Lighter(first.astype(np.int64), np.ascontiguousarray(turned[once]), cell, face, count)


def parts_of(positions: F32, faces: I64, size: int = PIECE_FACES) -> tuple[Part, ...]:
    """Return the faces in parts of about `size`, each of neighbours in slices along an axis."""
    axis = int(np.argmax(np.ptp(positions, axis=0)))
    order = np.argsort(positions[faces[:, 0], axis], kind="stable")
    parts = []
    local = np.zeros(len(positions), dtype=np.int64)
    for of in np.array_split(order, max(1, round(len(faces) / size))):
        mask = np.zeros(len(positions), dtype=bool)
        mask[faces[of].ravel()] = True
        ids = np.flatnonzero(mask)
        local[ids] = np.arange(len(ids))
        parts.append(Part(ids, local[faces[of]], of))
    return tuple(parts)
