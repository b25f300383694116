"""Region: the region of interest (ROI), its rims, and the patch of mesh that the solves see."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from engine.arrays import B1, F64, I64, frozen
from engine.errors import RegionError
from engine.mesh import Mesh
from engine.operators import Laplacian, laplacian


class Region:
    """A set of vertices that may move, and what surrounds them.

    Parameters
    ----------
    mesh : the mesh.
    roi : vertex ids chosen by the person, in any order.
    free_borders : let the vertices of open borders inside the choice move too.

    Attributes
    ----------
    roi : (m,) ascending ids of the vertices that move: the chosen ones without `held` and `unused`.
    held : chosen vertices that stay: open borders (unless freed) and non-manifold edges.
    unused : chosen vertices that no face refers to; they are left alone.
    rim : ids outside `roi` that share an edge with it (the paper's BV).
    rim2 : ids outside both that share an edge with `rim`.
    patch : ids of roi, rim and rim2 and of the further corners of their faces, roi first.

    Raises
    ------
    RegionError
        Nothing is left to move, or a connected part of it touches no vertex that stays.
    """

    def __init__(self, mesh: Mesh, roi: ArrayLike, free_borders: bool = False) -> None:
        self.mesh = mesh
        self.free_borders = free_borders
        chosen = _checked_ids(roi, mesh.n)
        topology = mesh.topology
        used = _in_proper_face(mesh)
        stays = topology.nonmanifold_vertices.copy()
        if not free_borders:
            stays |= topology.border_vertices
        self.unused: I64 = frozen(chosen[~used[chosen]], np.int64)
        self.held: I64 = frozen(chosen[used[chosen] & stays[chosen]], np.int64)
        self.roi: I64 = frozen(chosen[used[chosen] & ~stays[chosen]], np.int64)
        if len(self.roi) == 0:
            raise RegionError(
                "Every vertex of the region lies on an open border or a non-manifold edge, or in "
                "no face, so none can move. Choose a region that reaches further inside."
            )
        adjacency = topology.adjacency
        inside = _mask(mesh.n, self.roi)
        ring1 = _ring(adjacency, inside)
        ring2 = _ring(adjacency, inside | ring1)
        self.rim: I64 = frozen(np.flatnonzero(ring1), np.int64)
        self.rim2: I64 = frozen(np.flatnonzero(ring2), np.int64)
        self._refuse_loose_parts(adjacency, ring1)

    def _refuse_loose_parts(self, adjacency: sp.csr_array, rim: B1) -> None:
        inner = sp.csr_array(adjacency[self.roi][:, self.roi])
        parts, label = connected_components(inner, directed=False)
        touches = np.asarray(adjacency[self.roi] @ rim.astype(np.float64)) > 0
        loose = np.setdiff1d(np.arange(parts), label[touches])
        if len(loose) == 0:
            return
        if len(loose) == parts:
            raise RegionError(
                "The region covers a whole part of the model: nothing is left that holds it. "
                "Leave some of the form outside."
            )
        count = int(np.isin(label, loose).sum())
        raise RegionError(
            f"{len(loose)} of the region's {parts} parts ({count} vertices) cover a whole part of "
            "the model and have no rim. Leave them out, or leave a vertex of each outside."
        )

    @property
    def m(self) -> int:
        """Number of vertices that move."""
        return len(self.roi)

    @cached_property
    def patch(self) -> I64:
        """Vertex ids of the patch: roi, then rim, then the rest of the faces at these."""
        first = np.concatenate([self.roi, self.rim])
        corners = _mask(self.mesh.n, self.mesh.faces[self._patch_faces].ravel())
        corners[first] = False
        ids: I64 = frozen(np.concatenate([first, np.flatnonzero(corners)]), np.int64)
        return ids

    @cached_property
    def _patch_faces(self) -> B1:
        core = _mask(self.mesh.n, self.roi) | _mask(self.mesh.n, self.rim)
        return np.asarray(core[self.mesh.faces].any(axis=1))

    @cached_property
    def faces(self) -> I64:
        """Faces of the patch as positions in `patch`, (f, 3)."""
        local = np.full(self.mesh.n, -1, dtype=np.int64)
        local[self.patch] = np.arange(len(self.patch))
        faces: I64 = frozen(local[self.mesh.faces[self._patch_faces]], np.int64)
        return faces

    @cached_property
    def centre(self) -> F64:
        """Middle of the patch's bounding box, (3,), mesh units."""
        x = self.mesh.vertices[self.patch]
        return np.asarray(x.min(axis=0) + (x.max(axis=0) - x.min(axis=0)) / 2)

    @cached_property
    def scale(self) -> float:
        """Diagonal of the patch's bounding box in mesh units."""
        x = self.mesh.vertices[self.patch] - self.centre
        return float(np.linalg.norm(x.max(axis=0) - x.min(axis=0)))

    @cached_property
    def x(self) -> F64:
        """Positions of the patch, centred and scaled to unit diagonal, (p, 3)."""
        return np.asarray((self.mesh.vertices[self.patch] - self.centre) / self.scale)

    @cached_property
    def laplacian(self) -> Laplacian:
        """K and M of the patch, exact on the rows of roi and rim."""
        return laplacian(self.x, self.faces)

    @cached_property
    def stiffness_roi(self) -> sp.csr_array:
        """K_II, (m, m), symmetric positive definite."""
        return sp.csr_array(self.laplacian.stiffness[: self.m, : self.m])

    @property
    def report(self) -> str:
        """What is different here than usual, in plain words; "" when nothing."""
        notes = []
        if len(self.unused):
            notes.append(
                f"{len(self.unused)} chosen vertices belong to no face and are left alone."
            )
        if len(self.held):
            notes.append(
                f"{len(self.held)} chosen vertices on open borders or non-manifold edges are held."
            )
        if self.laplacian.report:
            notes.append(self.laplacian.report)
        return " ".join(notes)

    @property
    def areas_roi(self) -> F64:
        """M_II, (m,), of the patch at unit diagonal."""
        return self.laplacian.areas[: self.m]

    @cached_property
    def rim_open(self) -> B1:
        """Mask over roi and rim of vertices whose ring is not closed; delta says nothing there."""
        ids = np.concatenate([self.roi, self.rim])
        t = self.mesh.topology
        return np.asarray((t.border_vertices | t.nonmanifold_vertices)[ids])


def _checked_ids(roi: ArrayLike, n: int) -> I64:
    ids = np.asarray(roi)
    if ids.dtype == np.bool_ and ids.shape == (n,):
        ids = np.flatnonzero(ids)
    if ids.ndim != 1 or ids.size == 0:
        raise RegionError("The region is empty. Draw a lasso around some vertices.")
    if ids.dtype.kind not in "iu":
        raise RegionError("The region's vertex ids are not whole numbers. Give integer ids.")
    if ids.min() < 0 or ids.max() >= n:
        raise RegionError(
            f"The region refers to a vertex that the mesh does not have (it has {n}). "
            "Choose the region again on this mesh."
        )
    return np.unique(ids.astype(np.int64))


def _in_proper_face(mesh: Mesh) -> B1:
    """Return the mask of vertices in some face with three different corners."""
    f = mesh.faces
    proper = (f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])
    return _mask(mesh.n, f[proper].ravel())


def _mask(n: int, ids: I64) -> B1:
    mask = np.zeros(n, dtype=bool)
    mask[ids] = True
    return mask


def _ring(adjacency: sp.csr_array, inside: B1) -> B1:
    return np.asarray((adjacency @ inside.astype(np.float64)) > 0) & ~inside
