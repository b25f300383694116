"""Figures about an edit, against forms whose figures are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from engine import Mesh, View, cotangent_stiffness, vertex_areas
from engine.measure import (
    dihedral_angles,
    edge_stretch,
    feature_amplitude,
    feature_heights,
    rim_dihedral,
    target_error,
)


def grid(n: int = 12, fold: float = 0.0) -> Mesh:
    """Square of n by n vertices over 0..1; the half beyond x = 0.5 is turned up by `fold`."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    over = np.maximum(x - 0.5, 0)
    flat = np.minimum(x, 0.5) + over * np.cos(fold)
    points = np.stack([flat, y, over * np.sin(fold)], axis=-1).reshape(-1, 3)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    a, b, c, d = corner, corner + n, corner + n + 1, corner + 1
    return Mesh(points, np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]))


@dataclass(frozen=True)
class Aim:
    anchors: np.ndarray
    view: View
    target: np.ndarray


def test_target_error_is_the_largest_distance_in_pixels() -> None:
    mesh = grid()
    view = View(np.eye(4), (200, 100))
    anchors = np.array([3, 40, 77])
    target = view.project(mesh.vertices[anchors])
    target[1] += (3.0, -4.0)
    assert target_error(mesh.vertices, [Aim(anchors, view, target)]) == pytest.approx(5.0)
    assert target_error(mesh.vertices, []) == 0.0


def test_stretch_of_a_scaled_mesh_is_the_scale() -> None:
    mesh = grid()
    stretch = edge_stretch(mesh, mesh.with_vertices(mesh.vertices * 1.7), np.arange(20))
    assert stretch.p5 == pytest.approx(1.7)
    assert stretch.highest == pytest.approx(1.7)


def test_stretch_looks_only_at_the_region() -> None:
    mesh = grid(12)
    moved = mesh.vertices.copy()
    moved[-1] += 5.0
    assert edge_stretch(mesh, mesh.with_vertices(moved), np.array([0, 1])).highest == 1.0
    assert edge_stretch(mesh, mesh.with_vertices(moved), np.array([mesh.n - 1])).highest > 5


@pytest.mark.parametrize("fold", [1e-7, 0.3, 2.0])
def test_dihedral_of_a_fold_is_its_angle(fold: float) -> None:
    angles = dihedral_angles(grid(13, fold))
    assert angles.max() == pytest.approx(fold, rel=1e-6)
    assert np.isclose(angles, fold, rtol=1e-6).sum() == 12
    assert np.isclose(angles, 0, atol=1e-9).sum() == len(angles) - 12


def test_rim_dihedral_sees_a_crease_at_the_rim_only() -> None:
    mesh = grid(13, 0.4)
    beside = np.flatnonzero(mesh.vertices[:, 2] > 0.001)  # starts one row beyond the fold
    far = np.flatnonzero(mesh.vertices[:, 0] < 0.2)
    assert rim_dihedral(mesh, beside) == pytest.approx(0.4)
    assert rim_dihedral(mesh, far) == pytest.approx(0.0, abs=1e-9)


def test_amplitude_of_a_wave_on_a_bent_sheet_is_the_wave() -> None:
    n = 60
    flat = grid(n)
    turn = flat.vertices[:, 0] * 1.5
    normal = np.stack([-np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    bent = np.stack([np.sin(turn), 1.5 * flat.vertices[:, 1], 1 - np.cos(turn)], axis=1)
    wave = 0.02 * np.sin(40 * flat.vertices[:, 1])
    plain = flat.with_vertices(bent)
    featured = flat.with_vertices(bent + wave[:, None] * normal)
    inner = np.arange(flat.n)
    heights = feature_heights(plain, featured, inner)
    assert np.allclose(heights, wave, atol=2e-4 * 0.02 + 1e-5)


def test_amplitude_is_that_of_the_features_without_the_swell() -> None:
    mesh = grid(80)
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    areas, stiffness = vertex_areas(mesh), cotangent_stiffness(mesh)
    wave = 0.01 * np.sin(2 * np.pi * 9 * x) * np.sin(2 * np.pi * 9 * y)
    swell = 0.5 * np.cos(np.pi * x) + 0.2 * y
    told = feature_amplitude(wave + swell, areas, stiffness)
    alone = feature_amplitude(wave, areas, stiffness)
    assert alone.rms == pytest.approx(0.01 / 2, rel=0.05)
    assert told.rms == pytest.approx(alone.rms, rel=0.05)
    assert feature_amplitude(3 * wave, areas, stiffness).rms == pytest.approx(3 * alone.rms)
    assert feature_amplitude(np.zeros(0), np.zeros(0), stiffness).rms == 0.0


def test_figures_do_not_depend_on_position_and_scale() -> None:
    rng = np.random.default_rng(3)
    mesh = grid(14)
    rough = mesh.with_vertices(mesh.vertices + 0.01 * rng.normal(size=mesh.vertices.shape))
    roi = np.arange(60, 120)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)

    def moved(m: Mesh) -> Mesh:
        return m.with_vertices(1e3 * m.vertices @ turn.T + 50.0)

    assert rim_dihedral(moved(rough), roi) == pytest.approx(rim_dihedral(rough, roi), rel=1e-6)
    there = feature_heights(moved(mesh), moved(rough), roi)
    assert np.allclose(there, 1e3 * feature_heights(mesh, rough, roi), rtol=1e-6, atol=1e-9)
