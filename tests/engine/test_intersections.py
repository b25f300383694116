"""Self-intersections are found where they are, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine import Mesh, SketchEdit, Stroke
from engine.intersections import self_intersections

from .shapes import camera, inner, plate, sphere, tube
from .test_edit import EDIT, PLATE, SIDE, row_of


def both(a: Mesh, b: Mesh) -> Mesh:
    return Mesh(np.vstack([a.vertices, b.vertices]), np.vstack([a.faces, b.faces + a.n]))


@pytest.mark.parametrize(
    "mesh", [sphere(3), plate(20, wave=0.1), tube(20, 12)], ids=["sphere", "plate", "tube"]
)
def test_a_simple_surface_has_none(mesh: Mesh) -> None:
    turn = Rotation.from_rotvec([0.3, 0.4, 0.5]).as_matrix()
    assert len(self_intersections(mesh)) == 0
    assert len(self_intersections(Mesh(1e-4 * mesh.vertices @ turn.T + 3.0, mesh.faces))) == 0


def test_two_triangles() -> None:
    x = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.3, 0.3, -1], [0.4, 0.3, 1], [0.3, 0.5, 1.0]])
    mesh = Mesh(x, [[0, 1, 2], [3, 4, 5]])
    assert self_intersections(mesh).tolist() == [[0, 1]]
    assert (
        len(self_intersections(Mesh(x + np.outer([0, 0, 0, 1, 1, 1], [5, 0, 0]), mesh.faces))) == 0
    )
    touching = x.copy()
    touching[3:, 2] += 1
    assert len(self_intersections(Mesh(touching, mesh.faces))) == 0


def test_a_fold_at_a_shared_corner() -> None:
    x = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0.2, -0.5], [1, 0.3, 0.5]])
    assert self_intersections(Mesh(x, [[0, 1, 2], [0, 3, 4]])).tolist() == [[0, 1]]
    x[3, 2] = 0.2
    assert len(self_intersections(Mesh(x, [[0, 1, 2], [0, 3, 4]]))) == 0


def test_two_balls_meet_along_a_circle() -> None:
    ball = sphere(4)
    other = Mesh(ball.vertices + np.array([1.0, 0.03, 0.02]), ball.faces)
    pairs = self_intersections(both(ball, other))
    assert (pairs[:, 0] < len(ball.faces)).all()
    assert (pairs[:, 1] >= len(ball.faces)).all()
    middle = both(ball, other).vertices[both(ball, other).faces[pairs].reshape(-1, 3)].mean(axis=1)
    assert np.abs(middle[:, 0] - 0.5).max() < 0.1
    # About as many as a circle of radius sqrt(3)/2 crosses.
    edge = np.sqrt(4 * np.pi / len(ball.faces))
    assert len(pairs) > 2 * np.pi * np.sqrt(0.75) / edge
    part = np.flatnonzero(ball.vertices[:, 2] > 0)
    assert 0 < len(self_intersections(both(ball, other), part)) < len(pairs)


def test_an_edit_reports_what_is_new() -> None:
    assert len(EDIT.prepare(PLATE).solve(EDIT.strokes).self_intersections) == 0
    # Two sheets; the lower one is pulled through the upper one.
    sheets = both(PLATE, Mesh(PLATE.vertices + np.array([0, 0, 0.1]), PLATE.faces))
    row = row_of(PLATE, 0.5, 0.25, 0.75)
    seen = SIDE.project(sheets.vertices[row] + np.array([0, 0, 0.2]))
    edit = SketchEdit(inner(PLATE, 0.12, 0.88), 0.0, (Stroke(row, SIDE, seen),))
    result = edit.prepare(sheets).solve(edit.strokes)
    assert len(result.self_intersections) > 20
    assert result.stretch.p95 > 1.01


def test_a_view_changes_nothing() -> None:
    view = camera((3.0, 3.0, 1.0), (0.5, 0.5, 0.0))
    still = Stroke(row_of(PLATE, 0.5, 0.3, 0.7), view, np.zeros((0, 2)))
    there = view.project(PLATE.vertices[still.anchors])
    edit = SketchEdit(inner(PLATE, 0.12, 0.88), 1.0, (Stroke(still.anchors, view, there),))
    result = edit.prepare(PLATE).solve(edit.strokes)
    assert len(result.self_intersections) == 0
    assert result.stretch.highest == pytest.approx(1)
