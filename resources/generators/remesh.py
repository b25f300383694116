"""From an implicit form to irregular, well-shaped triangles lying exactly on it.

A form is a function ``value(p)`` of points (n, 3) in millimetres, negative inside, growing at
about one per millimetre near the surface. All functions here are deterministic.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pymeshlab
import pyvista as pv
import scipy.sparse as sp
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int64]
Form = Callable[[Points], NDArray[np.float64]]

# Corners of a tetrahedron: central differences from four samples instead of six.
_CORNERS = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], dtype=float)


def polygonise(form: Form, lower: Points, upper: Points, step: float) -> tuple[Points, Faces]:
    """Return the zero set of a form inside a box, sampled on a grid of the given step (mm)."""
    size = np.ceil((np.asarray(upper) - lower) / step).astype(int) + 1
    image = pv.ImageData(dimensions=size, spacing=(step,) * 3, origin=lower)
    points = np.asarray(image.points, dtype=float)
    values = np.concatenate(
        [form(part) for part in np.array_split(points, 1 + len(points) // 10**6)]
    )
    surface = image.contour([0.0], scalars=values, method="flying_edges").triangulate().clean()
    return np.asarray(surface.points, dtype=float), surface.regular_faces.astype(np.int64)


def remesh(
    vertices: Points,
    faces: Faces,
    edge: float,
    crease: float = 120.0,
    only: NDArray[np.bool_] | None = None,
) -> tuple[Points, Faces]:
    """Return an isotropic remeshing with the given edge length (mm), of all or masked vertices."""
    meshes = pymeshlab.MeshSet()
    chosen = np.ones(len(vertices)) if only is None else only.astype(float)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces, v_scalar_array=chosen))
    meshes.compute_selection_by_condition_per_vertex(condselect="q > 0.5")
    meshes.compute_selection_transfer_vertex_to_face()
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=12,
        selectedonly=only is not None,
        targetlen=pymeshlab.PureValue(edge),
        featuredeg=crease,
        checksurfdist=False,
    )
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix().astype(float), mesh.face_matrix().astype(np.int64)


def gradient(form: Form, p: Points, reach: float = 1e-3) -> Points:
    """Return the gradient of a form at points, (n, 3), by differences over ``reach`` mm."""
    slope = np.zeros_like(p)
    for corner in _CORNERS:
        slope += corner * form(p + reach * corner)[:, None]
    return slope / (4 * reach)


def project(form: Form, p: Points, steps: int = 8) -> Points:
    """Return the points moved along the gradient onto the zero set (damped Newton steps)."""
    for _ in range(steps):
        slope = gradient(form, p)
        move = form(p)[:, None] * slope / np.maximum((slope**2).sum(axis=1, keepdims=True), 0.05)
        length = np.linalg.norm(move, axis=1, keepdims=True)
        p = p - move * np.minimum(1.0, 2.0 / np.maximum(length, 1e-12))
    return p


def relax(
    form: Form,
    vertices: Points,
    faces: Faces,
    rounds: int = 10,
    held: NDArray[np.bool_] | None = None,
) -> Points:
    """Even out the triangles: slide vertices in the surface towards their neighbours' mean.

    Vertices in the mask ``held`` (n,) stay.
    """
    n = len(vertices)
    i, j = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    ring = sp.csr_array((np.ones(len(i)), (i, j)), shape=(n, n))
    ring = ((ring + ring.T) > 0).astype(float)
    count = np.asarray(ring.sum(axis=1)).reshape(-1, 1)
    for _ in range(rounds):
        normal = gradient(form, vertices)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        move = 0.6 * (ring @ vertices / count - vertices)
        move -= (move * normal).sum(axis=1, keepdims=True) * normal
        if held is not None:
            move[held] = 0.0
        vertices = project(form, vertices + move, steps=2)
    return project(form, vertices)


def mesh_form(
    form: Form,
    lower: Points,
    upper: Points,
    step: float,
    edge: float,
    fine: tuple[Callable[[Points], NDArray[np.bool_]], float] | None = None,
) -> tuple[Points, Faces]:
    """Return an irregular triangle mesh of a form's zero set, its vertices exactly on it.

    ``fine`` names a part to mesh with another edge length.
    """
    vertices, faces = polygonise(form, lower, upper, step)
    vertices = project(form, vertices, steps=3)
    vertices, faces = remesh(vertices, faces, edge)
    if fine is not None:
        part, fine_edge = fine
        vertices = project(form, vertices)
        vertices, faces = remesh(vertices, faces, fine_edge, only=part(vertices))
    vertices = relax(form, vertices, faces)
    return vertices, outward(vertices, faces)


def heights(plain_form: Form, vertices: Points, plain: Points) -> NDArray[np.float64]:
    """Return how far vertices lie outside (positive) or inside the plain form, (n,) mm."""
    return np.copysign(np.linalg.norm(vertices - plain, axis=1), plain_form(vertices))


def outward(vertices: Points, faces: Faces) -> Faces:
    """Return the faces of a closed mesh turned so that its volume is positive."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c))
    return faces if volume > 0 else faces[:, ::-1].copy()
