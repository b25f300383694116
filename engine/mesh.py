"""Mesh: frozen vertex and face arrays, validated at the door; adjacency derived when asked for."""

from __future__ import annotations

import hashlib
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from engine.arrays import B1, F64, I64, distinct, frozen
from engine.errors import MeshError, PositionsError


class Topology:
    """What follows from the faces alone; shared by all meshes with the same faces.

    Parameters
    ----------
    faces : (f, 3) int64, read-only.
    n : number of vertices.
    """

    def __init__(self, faces: I64, n: int) -> None:
        self.faces = faces
        self.n = n

    @cached_property
    def _edges_with_counts(self) -> tuple[I64, I64]:
        corners = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        low = corners.min(axis=1)
        high = corners.max(axis=1)
        keys, counts = np.unique(low * np.int64(self.n) + high, return_counts=True)
        edges = np.column_stack([keys // self.n, keys % self.n])
        proper = edges[:, 0] != edges[:, 1]
        return edges[proper], counts[proper]

    @property
    def edges(self) -> I64:
        """Undirected edges, (e, 2) int64, smaller index first, in lexicographic order."""
        return self._edges_with_counts[0]

    @property
    def edge_face_counts(self) -> I64:
        """Number of faces at each edge, (e,): 1 on a border, 2 inside, more where non-manifold."""
        return self._edges_with_counts[1]

    @cached_property
    def adjacency(self) -> sp.csr_array:
        """Symmetric vertex adjacency, (n, n) CSR of ones, no diagonal."""
        e = self.edges
        ones = np.ones(2 * len(e))
        i = np.concatenate([e[:, 0], e[:, 1]])
        j = np.concatenate([e[:, 1], e[:, 0]])
        return sp.csr_array((ones, (i, j)), shape=(self.n, self.n))

    @cached_property
    def incidence(self) -> sp.csr_array:
        """Vertex-face incidence, (n, f) CSR of ones."""
        f = len(self.faces)
        data = np.ones(3 * f)
        return sp.csr_array(
            (data, (self.faces.ravel(), np.repeat(np.arange(f), 3))), shape=(self.n, f)
        )

    def faces_about(self, ids: I64) -> I64:
        """Return the faces that have a corner among the vertices `ids`, ascending, each once."""
        if 8 * len(ids) < self.n:
            return distinct(self.incidence[ids].indices, len(self.faces))
        among = np.zeros(self.n, dtype=bool)
        among[ids] = True
        return np.flatnonzero(among[self.faces].any(axis=1))

    @cached_property
    def border_vertices(self) -> B1:
        """Mask (n,) of the vertices on an open border."""
        mask = np.zeros(self.n, dtype=bool)
        mask[self.edges[self.edge_face_counts == 1].ravel()] = True
        return mask

    @cached_property
    def nonmanifold_vertices(self) -> B1:
        """Mask (n,) of the vertices on an edge with three or more faces."""
        mask = np.zeros(self.n, dtype=bool)
        mask[self.edges[self.edge_face_counts > 2].ravel()] = True
        return mask

    @cached_property
    def used_vertices(self) -> B1:
        """Mask (n,) of the vertices that some face refers to."""
        mask = np.zeros(self.n, dtype=bool)
        mask[self.faces.ravel()] = True
        return mask

    @cached_property
    def components(self) -> I64:
        """Connected-component label of every vertex, (n,)."""
        from scipy.sparse.csgraph import connected_components

        return np.asarray(connected_components(self.adjacency, directed=False)[1], dtype=np.int64)


class Mesh:
    """A triangle mesh that never changes.

    Parameters
    ----------
    vertices : (n, 3) float64, positions in mesh units (millimetres unless the file says else).
    faces : (f, 3) int64, vertex indices, counter-clockwise seen from outside.

    Raises
    ------
    MeshError
        Wrong shape, a coordinate that is not finite, an index out of range, or no face.
    """

    __slots__ = ("__dict__", "__weakref__", "faces", "topology", "vertices")

    vertices: F64
    faces: I64
    topology: Topology

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        self.vertices = _checked_vertices(vertices)
        self.faces = _checked_faces(faces, len(self.vertices))
        self.topology = Topology(self.faces, len(self.vertices))

    def with_vertices(self, vertices: ArrayLike) -> Mesh:
        """Return the mesh with the same faces (the same object) at other positions, (n, 3).

        Raises
        ------
        PositionsError
            There are more or fewer positions, or one is not finite.
        """
        moved = _checked_vertices(vertices)
        if moved.shape != self.vertices.shape:
            raise PositionsError(
                f"{len(moved)} positions were given for {len(self.vertices)} vertices. "
                "Give one position for each vertex."
            )
        mesh = object.__new__(Mesh)
        mesh.vertices = moved
        mesh.faces = self.faces
        mesh.topology = self.topology
        return mesh

    @property
    def n(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @cached_property
    def bounds(self) -> F64:
        """Lower and upper corner of the bounding box of the used vertices, (2, 3)."""
        mask = self.topology.used_vertices
        used = self.vertices if mask.all() else self.vertices[mask]
        # Column by column: along the long axis numpy takes twenty times as long.
        columns = [used[:, k] for k in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @cached_property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal in mesh units."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))

    @cached_property
    def face_normals(self) -> F64:
        """Face normals times twice the area, (f, 3)."""
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def vertex_normals(self) -> F64:
        """Area-weighted unit normals, (n, 3); zero where no face has an area."""
        summed: F64 = np.asarray(self.topology.incidence @ self.face_normals)
        length = np.linalg.norm(summed, axis=1, keepdims=True)
        normals: F64 = np.divide(summed, length, out=np.zeros_like(summed), where=length > 0)
        return normals

    @cached_property
    def digest(self) -> str:
        """SHA-256 of vertices and faces, as 64 hexadecimal digits."""
        h = hashlib.sha256()
        h.update(np.array([len(self.vertices), len(self.faces)], dtype=np.int64).tobytes())
        h.update(self.vertices.astype("<f8").tobytes())
        h.update(self.faces.astype("<i8").tobytes())
        return h.hexdigest()

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"


def _checked_vertices(vertices: ArrayLike) -> F64:
    x: F64 = frozen(vertices, np.float64)
    if x.ndim != 2 or x.shape[1] != 3:
        raise PositionsError(
            f"The vertices have the shape {x.shape}. Give one row of x, y, z each."
        )
    if not np.isfinite(x).all():
        bad = int((~np.isfinite(x)).any(axis=1).sum())
        raise PositionsError(
            f"{bad} of {len(x)} vertices have a coordinate that is not a finite number. "
            "Remove them or open the file with cleanup."
        )
    return x


def _checked_faces(faces: ArrayLike, n: int) -> I64:
    f = np.asarray(faces)
    if f.ndim != 2 or f.shape[1] != 3:
        raise MeshError(f"The faces have the shape {f.shape}. Triangulate the mesh first.")
    if len(f) == 0:
        raise MeshError("The mesh has no faces. Open a file that holds a surface.")
    if f.dtype.kind not in "iu":
        raise MeshError("The face indices are not whole numbers. Give integer vertex indices.")
    if f.min() < 0 or f.max() >= n:
        raise MeshError(
            f"A face refers to vertex {int(f.max() if f.max() >= n else f.min())}, but the "
            f"vertices are numbered 0 to {n - 1}. Repair the file in the program that wrote it."
        )
    return frozen(f, np.int64)
