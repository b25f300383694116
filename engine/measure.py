"""What an edit did, in figures: target error, stretch, crease at the rim, height of features."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from engine.arrays import B1, F64, I64
from engine.mesh import Mesh
from engine.solve import factorise
from engine.view import View

FEATURES_PER_SIZE = 3.0
"""What has this many waves or more over the region's size (the root of its area) is a feature."""


class Aimed(Protocol):
    """A curve of vertices with the pixels they shall project to (a `Stroke`)."""

    @property
    def anchors(self) -> I64:
        """Vertex ids, (c,)."""
        ...

    @property
    def view(self) -> View:
        """The camera that the target was drawn in."""
        ...

    @property
    def target(self) -> F64:
        """Where the anchors shall be seen, (c, 2) px."""
        ...


@dataclass(frozen=True)
class Stretch:
    """Percentiles of edge length after over before; 1 is no stretch."""

    p5: float
    median: float
    p95: float
    highest: float


@dataclass(frozen=True)
class Amplitude:
    """Height of the features of a region, along the normals of the form below, mesh units.

    `rms` is the area-weighted root of the mean square, `p95` the 95th percentile of the magnitude.
    """

    rms: float
    p95: float


def target_error(vertices: F64, strokes: Iterable[Aimed]) -> float:
    """Return the largest distance between a reprojected anchor and its target, in pixels.

    Parameters
    ----------
    vertices : (n, 3) deformed positions, of the surface that the anchors were pulled on.
    strokes : each with `anchors` (c,), `target` (c, 2) px in `view`.

    Returns
    -------
    The maximum over all anchors of all strokes; 0 when there is none.
    """
    worst = 0.0
    for stroke in strokes:
        seen = stroke.view.project(vertices[stroke.anchors])
        away = np.linalg.norm(seen - stroke.target, axis=1)
        worst = max(worst, float(away.max(initial=0.0)))
    return worst


def edge_stretch(before: Mesh, after: Mesh, roi: I64) -> Stretch:
    """Return how much the edges inside and at the border of a region changed length.

    Parameters
    ----------
    before, after : meshes with the same faces.
    roi : (m,) vertex ids; every edge with at least one end among them counts.
    """
    inside = _mask(before.n, roi)
    edges = before.topology.edges
    edges = edges[inside[edges].any(axis=1)]
    old = _lengths(before.vertices, edges)
    ratio = _lengths(after.vertices, edges)[old > 0] / old[old > 0]
    if len(ratio) == 0:
        return Stretch(1.0, 1.0, 1.0, 1.0)
    p5, median, p95 = np.percentile(ratio, [5, 50, 95])
    return Stretch(float(p5), float(median), float(p95), float(ratio.max()))


def dihedral_angles(mesh: Mesh, near: B1 | None = None) -> F64:
    """Return the angle between the normals of the two faces at edges, radians in 0..pi.

    Parameters
    ----------
    mesh : the mesh.
    near : (f,) mask; only edges of which at least one face is in it. None for all edges.

    Returns
    -------
    One angle for each edge with exactly two faces; 0 is flat.
    """
    first, second = face_pairs(mesh)
    if near is not None:
        kept = near[first] | near[second]
        first, second = first[kept], second[kept]
    a, b = mesh.face_normals[first], mesh.face_normals[second]
    # atan2 keeps its accuracy at small angles, where arccos of the cosine has none.
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)))


def rim_dihedral(mesh: Mesh, roi: I64, percentile: float = 95.0) -> float:
    """Return a percentile of the dihedral angles along the region's border, radians.

    The edges that count are those of the faces that have corners both inside and outside the
    region: a crease between the edited and the held part shows there and nowhere else.

    Parameters
    ----------
    mesh : the mesh.
    roi : (m,) vertex ids of the region.
    percentile : 0..100.
    """
    corners = _mask(mesh.n, roi)[mesh.faces]
    border = np.logical_and(corners.any(axis=1), ~corners.all(axis=1))
    angles = dihedral_angles(mesh, border)
    return float(np.percentile(angles, percentile)) if len(angles) else 0.0


def feature_heights(plain: Mesh, featured: Mesh, ids: I64) -> F64:
    """Return the signed height of features above the surface without them.

    ``h_i = (x_i - b_i) . n_i`` with `n` the unit normals of the surface without features.

    Parameters
    ----------
    plain, featured : meshes with the same faces, without and with the features.
    ids : (m,) the vertices to measure.

    Returns
    -------
    (m,) in mesh units.
    """
    offset = featured.vertices[ids] - plain.vertices[ids]
    return np.asarray((offset * plain.vertex_normals[ids]).sum(axis=1))


def feature_amplitude(heights: F64, areas: F64, stiffness: sp.csr_array) -> Amplitude:
    """Return how high the features of a region stand, whatever swells more slowly left out.

    The heights above a fair surface hold broad swells too, which are form and no feature. They are
    taken off by `(M + t^2 K M^-1 K) swell = M h`, which halves what is as long as a third of the
    region's size. Measured before an edit, against the surface at its level, and after it, against
    the deformed surface, both with the areas and stiffness of the region before the edit, it says
    how much of the features' height was kept.

    Parameters
    ----------
    heights : (m,) from `feature_heights`.
    areas, stiffness : (m,) M_II and (m, m) K_II of the region before the edit.
    """
    total = float(areas.sum())
    if len(heights) == 0 or total <= 0:
        return Amplitude(0.0, 0.0)
    t = total / (2 * np.pi * FEATURES_PER_SIZE) ** 2
    bending = stiffness @ sp.diags_array(t**2 / areas) @ stiffness
    fair = factorise(sp.csr_array(sp.diags_array(areas) + bending))
    fine = heights - fair.solve(areas * heights)
    rms = float(np.sqrt(areas @ fine**2 / total))
    return Amplitude(rms, float(np.percentile(np.abs(fine), 95)))


def _mask(n: int, ids: I64) -> B1:
    mask = np.zeros(n, dtype=bool)
    mask[ids] = True
    return mask


def _lengths(vertices: F64, edges: I64) -> F64:
    return np.asarray(np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1))


def face_pairs(mesh: Mesh) -> tuple[I64, I64]:
    """Return the two faces of every edge that has exactly two, (e,) and (e,)."""
    corners = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = corners.min(axis=1) * np.int64(mesh.n) + corners.max(axis=1)
    order = np.argsort(key, kind="stable")
    _, start, count = np.unique(key[order], return_index=True, return_counts=True)
    pair = start[count == 2]
    return order[pair] // 3, order[pair + 1] // 3
