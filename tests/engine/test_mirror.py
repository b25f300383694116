"""Symmetric editing: the change is mirrored, on equal and on unequal triangles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine import EditOptions, Mesh, SketchEdit, Source, mirrored_region, symmetry_plane
from engine.arrays import I64
from engine.curves import positions_along, values_along
from engine.mirror import reflected, reflection

from .shapes import camera, inner, plate, sphere
from .test_edit import lifted

ACROSS = (0.0, 1.0, 0.0, 0.0)
BALL = sphere(4)
VIEW = camera((5.0, 2.0, 1.0))


def side(mesh: Mesh, low: float = 0.15) -> I64:
    return np.flatnonzero((mesh.vertices[:, 1] > low) & (mesh.vertices[:, 0] > -0.2))


def arc(mesh: Mesh) -> I64:
    """Vertices along a curve on the ball's right side."""
    t = np.linspace(0.2, 1.2, 25)
    wanted = np.column_stack([np.cos(t), 0.6 + 0 * t, np.sin(t) - 0.5])
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    ids = np.linalg.norm(mesh.vertices[None] - wanted[:, None], axis=2).argmin(axis=1)
    return np.asarray(ids[np.sort(np.unique(ids, return_index=True)[1])])


def twin_ids(mesh: Mesh, ids: I64) -> I64:
    images = reflected(mesh.vertices[ids], ACROSS)
    return np.asarray(np.linalg.norm(mesh.vertices[None] - images[:, None], axis=2).argmin(axis=1))


def test_reflection_is_its_own_inverse() -> None:
    R = reflection((1.0, 2.0, -0.5, 0.7))
    assert np.allclose(R @ R, np.eye(4))
    on_plane = np.array([[0.7, 0, 0], [0, 0.35, 0]])
    assert np.allclose(reflected(on_plane, (1.0, 2.0, -0.5, 0.7)), on_plane)


def test_on_a_symmetric_mesh_the_change_is_symmetric_and_both_sides_meet_the_target() -> None:
    stroke = lifted(BALL, VIEW, arc(BALL), 60)
    edit = SketchEdit(side(BALL), 0.0, (stroke,), EditOptions(mirror=ACROSS))
    prepared = edit.prepare(BALL)
    result = prepared.solve(edit.strokes)
    assert result.target_error_px < 0.5
    everything = np.arange(BALL.n)
    images = reflected(result.vertices[twin_ids(BALL, everything)], ACROSS)
    assert np.abs(images - result.vertices).max() < 1e-7
    assert np.abs(result.vertices - BALL.vertices).max() > 0.05


def test_the_region_gets_its_twin() -> None:
    one = side(BALL)
    both = mirrored_region(BALL, one, ACROSS)
    assert np.array_equal(both, np.union1d(one, twin_ids(BALL, one)))


def test_other_triangles_on_the_other_side() -> None:
    # Turned by an odd angle the ball is the same form with other vertices on both sides.
    turn = Rotation.from_rotvec([0.3, 0.2, 0.5]).as_matrix()
    mesh = Mesh(BALL.vertices @ turn.T, BALL.faces)
    stroke = lifted(mesh, VIEW, arc(mesh), 60)
    edit = SketchEdit(side(mesh), 0.0, (stroke,), EditOptions(mirror=ACROSS))
    after = edit.apply(mesh).vertices
    way = np.linalg.norm(after - mesh.vertices, axis=1)
    moved = np.linalg.norm(after, axis=1) - 1
    right, left = mesh.vertices[:, 1] > 0, mesh.vertices[:, 1] < 0
    assert way[right].max() == pytest.approx(way[left].max(), rel=0.03)
    # Heights over the ball agree where the two sides face each other.
    images = reflected(mesh.vertices[right], ACROSS)
    away = np.linalg.norm(mesh.vertices[left][None] - images[:, None], axis=2)
    close = away.min(axis=1) < 0.01
    other = moved[left][away.argmin(axis=1)]
    assert np.abs(moved[right] - other)[close].max() < 0.02 * way.max()


def test_a_still_stroke_moves_nothing_on_either_side() -> None:
    still = Source(arc(BALL), VIEW).still(BALL)
    edit = SketchEdit(side(BALL), 1.0, (still,), EditOptions(mirror=ACROSS))
    assert (edit.apply(BALL).vertices == BALL.vertices).all()


def test_a_curve_across_the_plane_is_made_symmetric() -> None:
    mesh = plate(31, jitter=0.0)
    row = np.arange(31) + 15 * 31
    row = row[5:26]
    view = camera((-3.0, 0.5, 0.6), (0.5, 0.5, 0.0))
    stroke = lifted(mesh, view, row, 40)
    stroke.target[:, 1] -= np.linspace(0, 30, len(row))
    options = EditOptions(mirror=(0.0, 1.0, 0.0, 0.5))
    after = SketchEdit(inner(mesh, 0.05, 0.95), 0.0, (stroke,), options).apply(mesh).vertices
    height = after[row, 2]
    assert np.abs(height - height[::-1]).max() < 0.02 * height.max()


def test_pins_hold_on_both_sides() -> None:
    pins = arc(BALL)[:3]
    stroke = lifted(BALL, VIEW, arc(BALL)[8:], 40)
    options = EditOptions(mirror=ACROSS, pins=tuple(pins.tolist()))
    edit = SketchEdit(side(BALL), 1.0, (stroke,), options)
    after = edit.apply(BALL).vertices
    both = np.union1d(pins, twin_ids(BALL, pins))
    assert np.abs(after[both] - BALL.vertices[both]).max() < 1e-7


def test_the_plane_is_found() -> None:
    plane, misfit = symmetry_plane(BALL)
    assert misfit < 1e-9
    assert plane[3] == pytest.approx(0, abs=1e-9)
    long = Mesh(
        BALL.vertices * [1, 2, 3] + [0.2 * (BALL.vertices[:, :1] > 0.5), 5, 0][1], BALL.faces
    )
    turn = Rotation.from_rotvec([0.5, -0.3, 0.8]).as_matrix()
    bent = long.vertices.copy()
    bent[:, 0] += 0.3 * bent[:, 2] ** 2
    found, misfit = symmetry_plane(Mesh(bent @ turn.T, BALL.faces))
    assert misfit < 1e-6
    assert abs(np.array(found[:3]) @ turn @ np.array([0, 1, 0])) == pytest.approx(1, abs=1e-6)
    lump = BALL.vertices.copy()
    lump *= 1 + np.exp(-8 * ((lump - [0.6, 0.64, 0.48]) ** 2).sum(axis=1, keepdims=True))
    lump *= 1 + np.exp(-8 * ((lump - [-0.6, 0.48, -0.64]) ** 2).sum(axis=1, keepdims=True))
    assert symmetry_plane(Mesh(lump, BALL.faces))[1] > 0.01


def test_positions_and_values_along_a_curve() -> None:
    curve = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0]])
    points = np.array([[0.25, 0.3, 0], [1.5, 1.0, 0], [-1, 0, 0], [0.4, 1.0, 0.0]])
    at = positions_along(curve, points)
    assert np.allclose(at, [0.25, 1.5, 0, 1.5])
    assert np.allclose(values_along(np.array([[0.0], [10], [30]]), at)[:, 0], [2.5, 20, 0, 20])
    around = positions_along(curve, np.array([[0.45, 1.0, 0]]), closed=True)
    assert 2 < around[0] < 3
    assert np.allclose(values_along(np.array([[0.0], [10], [30]]), np.array([2.5]), True), [[15]])
