"""Edits across a plane of symmetry: region, curves and pins get a twin on the other side.

It is the change that is mirrored, not the mesh: the two sides may have different triangles and
different details, and keep them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.spatial import cKDTree

from engine.arrays import F64, I64, distinct
from engine.curves import positions_along, values_along
from engine.mesh import Mesh
from engine.run import Run
from engine.view import View

if TYPE_CHECKING:
    from collections.abc import Sequence

    from engine.edit import Stroke

Plane = tuple[float, ...]

# A vertex has a twin where the surface is at most so many edge lengths from its mirror image.
_TWIN_EDGES = 4.0
_SAMPLES = 3000
_FINDING = "Finding the plane of symmetry"


def reflection(plane: Plane) -> F64:
    """Return the reflection across the plane a x + b y + c z = d as a (4, 4) matrix."""
    normal = np.array(plane[:3], dtype=np.float64)
    size = float(np.linalg.norm(normal))
    normal = normal / size
    R = np.eye(4)
    R[:3, :3] -= 2 * np.outer(normal, normal)
    R[:3, 3] = 2 * (plane[3] / size) * normal
    return R


def reflected(points: F64, plane: Plane) -> F64:
    """Return the mirror images of points (p, 3)."""
    R = reflection(plane)
    return np.asarray(points @ R[:3, :3].T + R[:3, 3])


def mirrored_region(mesh: Mesh, roi: I64, plane: Plane) -> I64:
    """Return the region with its twin on the other side, ascending ids.

    A vertex belongs to the twin when the mesh vertex nearest to its mirror image is in the region,
    so a finer or coarser other side gets no holes.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) vertex ids.
    plane : a, b, c, d: the points with a x + b y + c z = d; its normal may have any length.
    """
    x = mesh.vertices[roi]
    reach = _TWIN_EDGES * _edge_length(mesh, roi)
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    # Only what lies near the mirrored region can belong to its twin, and is not in it anyway.
    there = reflected(x, plane)
    near = _in_box(mesh.vertices, there.min(axis=0) - reach, there.max(axis=0) + reach)
    near = near[~inside[near]]
    images = reflected(mesh.vertices[near], plane)
    low, high = x.min(axis=0), x.max(axis=0)
    close = _in_box(images, low - reach, high + reach)
    near, images = near[close], images[close]
    if len(near) == 0:
        return distinct(roi, mesh.n)
    # And only what lies near the region can be so near to an image there.
    about = _in_box(mesh.vertices, low - 2 * reach, high + 2 * reach)
    # Of points on a surface a tree split in the middle of its boxes is made and asked quicker.
    tree = cKDTree(mesh.vertices[about], balanced_tree=False, compact_nodes=False)
    away, nearest = tree.query(images, distance_upper_bound=reach)
    met = np.isfinite(away)
    twin = near[met][inside[about[nearest[met]]]]
    return distinct(np.concatenate([roi, twin]), mesh.n)


def _in_box(points: F64, low: F64, high: F64) -> I64:
    """Return which of the points (p, 3) lie in a box, ascending."""
    inside = np.ones(len(points), dtype=bool)
    for k in range(3):  # along the short axis numpy takes ten times as long
        inside &= (points[:, k] >= low[k]) & (points[:, k] <= high[k])
    return np.flatnonzero(inside)


def _edge_length(mesh: Mesh, roi: I64) -> float:
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    links = mesh.topology.adjacency[roi]
    a, b = np.repeat(roi, np.diff(links.indptr)), links.indices
    once = ~inside[b] | (a < b)
    apart = mesh.vertices[a[once]] - mesh.vertices[b[once]]
    return float(np.linalg.norm(apart, axis=1).mean()) if len(apart) else 0.0


class Twins:
    """Finds the vertices of a region that stand for given ones on the other side.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) ids that may be twins.
    plane : a, b, c, d.
    """

    def __init__(self, mesh: Mesh, roi: I64, plane: Plane) -> None:
        self._mesh = mesh
        self._roi = roi
        self._plane = plane
        self._tree = cKDTree(mesh.vertices[roi])

    def of(self, ids: I64) -> I64:
        """Return the twins of vertices in their order, each once, (q,)."""
        images = reflected(self._mesh.vertices[ids], self._plane)
        found = self._roi[self._tree.query(images)[1]]
        return np.asarray(found[np.sort(np.unique(found, return_index=True)[1])])

    def stroke(self, stroke: Stroke, rest: F64) -> Stroke:
        """Return the twin of a stroke: the same way on the other side, in the mirrored view.

        The mirrored view sees the mirror image of a point where the view sees the point. Each twin
        goes as far as the place on the source curve that it is the image of.

        Parameters
        ----------
        stroke : the stroke.
        rest : (n, 3) the surface that it deforms.
        """
        way = stroke.target - stroke.view.project(rest[stroke.anchors])
        twins = self.of(stroke.anchors)
        back = reflected(self._mesh.vertices[twins], self._plane)
        at = positions_along(self._mesh.vertices[stroke.anchors], back, stroke.closed)
        view = View(stroke.view.matrix @ reflection(self._plane), stroke.view.size)
        target = view.project(rest[twins]) + values_along(way, at, stroke.closed)
        weights = stroke.weights
        if weights is not None:
            weights = values_along(weights[:, None], at, stroke.closed)[:, 0]
        return type(stroke)(twins, view, target, stroke.closed, weights)

    def with_twins(self, strokes: Sequence[Stroke], rest: F64) -> list[Stroke]:
        """Return the strokes and their twins on the surface `rest` (n, 3)."""
        return [*strokes, *(self.stroke(stroke, rest) for stroke in strokes)]


def middle_plane(mesh: Mesh, axis: Literal["x", "y", "z"]) -> Plane:
    """Return the plane across a coordinate axis, through the middle of the mesh: a, b, c, d."""
    which = "xyz".index(axis)
    normal = np.eye(3)[which]
    return (*normal.tolist(), float(mesh.bounds.mean(axis=0)[which]))


def symmetry_plane(mesh: Mesh, run: Run | None = None) -> tuple[Plane, float]:
    """Return the plane that maps the mesh best on itself, and how far it is off.

    Planes tried go through the middle of the surface, across its principal and coordinate axes.

    Parameters
    ----------
    mesh : the mesh.
    run : reports, and is asked to stop.

    Returns
    -------
    plane : a, b, c, d with a unit normal.
    misfit : root mean square distance of mirrored vertices to the mesh's nearest vertex, as a share
        of the diagonal; below 0.01 the mesh may be called symmetric.
    """
    run = run or Run()
    run.tick(0.0, _FINDING)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    middles = (a + b + c) / 3
    weight = np.linalg.norm(mesh.face_normals, axis=1)
    centre = (weight @ middles) / max(float(weight.sum()), 1e-300)
    spread = middles - centre
    principal = np.linalg.eigh((spread * weight[:, None]).T @ spread)[1].T
    run.tick(0.1, _FINDING)
    tree = cKDTree(mesh.vertices)
    step = max(1, mesh.n // _SAMPLES)
    sample = mesh.vertices[mesh.topology.used_vertices][::step]
    best: tuple[Plane, float] = ((1.0, 0.0, 0.0, 0.0), np.inf)
    throughs = (centre, mesh.bounds.mean(axis=0))
    tried = [(normal, point) for normal in (*np.eye(3), *principal) for point in throughs]
    for i, (normal, point) in enumerate(tried):
        run.tick(0.2 + 0.8 * i / len(tried), _FINDING)
        plane = (*normal.tolist(), float(normal @ point))
        # What is farther than by the best so far makes it no better: a point far from the mesh
        # takes a thousand times as long to find the nearest to.
        bound = _hopeless(best[1] * mesh.diagonal, len(sample))
        away = tree.query(reflected(sample, plane), distance_upper_bound=bound)[0]
        misfit = float(np.sqrt((away**2).mean())) / mesh.diagonal
        if misfit < 0.999 * best[1]:
            best = (plane, misfit)
    return best


def _hopeless(misfit: float, count: int) -> float:
    """Return the distance at which one of `count` points alone has a larger mean square."""
    return misfit * float(np.sqrt(count))
