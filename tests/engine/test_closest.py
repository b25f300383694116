"""Closest points against an independent library."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Mesh, closest_points
from tests.app.driving import bumpy_sphere

igl = pytest.importorskip("igl")


@pytest.fixture(scope="module")
def sphere() -> Mesh:
    return bumpy_sphere()


def test_they_are_those_of_another_library(sphere: Mesh) -> None:
    rng = np.random.default_rng(7)
    points = sphere.vertices[rng.integers(0, sphere.n, 3000)]
    points = points + rng.normal(0, 0.02 * sphere.diagonal, points.shape)
    found = closest_points(sphere, points)
    squared = igl.point_mesh_squared_distance(points, sphere.vertices, sphere.faces)[0]
    best = np.sqrt(squared)
    assert (found.distances >= best - 1e-9).all()
    exact = found.distances <= best + 1e-9
    assert exact.mean() > 0.995
    assert found.distances == pytest.approx(best, abs=2e-3 * sphere.diagonal)
    # What is returned is consistent with itself.
    assert np.linalg.norm(found.points - points, axis=1) == pytest.approx(found.distances)
    a, b, c = (sphere.vertices[sphere.faces[found.faces, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    height = ((found.points - a) * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    assert np.abs(height).max() < 1e-9 * sphere.diagonal


def test_every_place_of_a_triangle_is_found() -> None:
    one = Mesh([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    asked = np.array(
        [[1, 1, 3], [-1, -1, 0], [6, -1, 1], [-2, 7, 0], [2, -3, 1], [-3, 2, 0], [4, 4, 2]], float
    )
    wanted = [[1, 1, 0], [0, 0, 0], [4, 0, 0], [0, 4, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0]]
    assert closest_points(one, asked).points == pytest.approx(np.array(wanted, float))
    assert len(closest_points(one, np.zeros((0, 3))).points) == 0


def test_of_the_faces_around_a_vertex_every_one_is_tried() -> None:
    angle = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), -0.5 * np.ones(6)])
    faces = [[6, i, (i + 1) % 6] for i in range(6)]
    tent = Mesh(np.vstack([ring, [[0, 0, 0]]]), faces)
    middle = tent.vertices[tent.faces].mean(axis=1)
    above = middle + 0.3 * tent.face_normals / np.linalg.norm(tent.face_normals, axis=1)[:, None]
    found = closest_points(tent, above)
    assert (found.faces == np.arange(6)).all()
    assert found.points == pytest.approx(middle)
    assert found.distances == pytest.approx(0.3)


def test_on_a_thin_wall_the_side_that_faces_the_same_way_is_meant() -> None:
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    i = np.arange(36).reshape(6, 6)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    up = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    top = np.column_stack([x.ravel(), y.ravel(), np.full(36, 0.1)])
    wall = Mesh(np.concatenate([top, top - [0, 0, 0.1]]), np.concatenate([up, up[:, ::-1] + 36]))
    asked = np.array([[2.3, 2.4, -0.5]])
    assert closest_points(wall, asked).points[0, 2] == 0.0
    upward = np.array([[0, 0, 1.0]])
    assert closest_points(wall, asked, upward).points[0, 2] == pytest.approx(0.1)
    lower = np.arange(len(wall.faces)) >= len(up)
    assert closest_points(wall, asked, upward, lower).points[0, 2] == 0.0
