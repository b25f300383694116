"""The base shape: closed forms, the two rules at the rim, an independent library."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import igl
import numpy as np
import pytest

from bench.rim import regions, rim_folds
from engine import Mesh, Region, decompose
from engine.base import Plate, paper_base
from engine.solve import factorise
from tests.engine.surfaces import (
    ball,
    dihedrals,
    flat,
    icosphere_like,
    interior,
    lifted,
    real,
)


def _bumps(mesh: Mesh, height: float, sharp: float = 30.0, seed: int = 3) -> np.ndarray:
    """Smooth bumps at random places, each about 1 / sqrt(sharp) wide, as heights (n,)."""
    at = mesh.vertices[np.random.default_rng(seed).choice(mesh.n, 40, replace=False)]
    distance = ((mesh.vertices[:, None] - at) ** 2).sum(axis=2)
    return height * np.exp(-sharp * distance).sum(axis=1)


def _placed(region: Region) -> np.ndarray:
    """The base of K M^-1 K x = 0 in mesh units."""
    placed: np.ndarray = Plate(region).plain() * region.scale + region.centre
    return placed


def _disc(mesh: Mesh, radius: float) -> np.ndarray:
    return np.flatnonzero(np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1) < radius)


@pytest.mark.parametrize("rim", ["smooth", "paper"])
def test_bumped_plane_comes_back_flat(rim: Literal["smooth", "paper"]) -> None:
    mesh = flat(3600)
    roi = _disc(mesh, 0.4)
    inside = np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1) < 0.36
    bumped = lifted(mesh, _bumps(mesh, 0.02, 800) * inside)
    base = decompose(bumped, roi, modes=0, rim=rim).base
    assert np.abs(bumped.vertices[roi, 2]).max() > 0.01
    assert np.abs(base[:, 2]).max() < 1e-9
    assert np.abs(base - mesh.vertices[roi]).max() < 0.01


def test_flat_sheet_with_its_open_border_held_stays_as_it_is() -> None:
    mesh = flat(900)
    base = decompose(mesh, np.arange(mesh.n), modes=0).base
    assert np.abs(base - mesh.vertices[interior(mesh)]).max() < 1e-10


def test_flat_sheet_with_its_border_freed_stays_as_it_is() -> None:
    mesh = flat(900)
    roi = np.flatnonzero(mesh.vertices[:, 0] < 0.6)
    for rim in ("smooth", "paper"):
        parts = decompose(mesh, roi, modes=0, rim=rim, free_borders=True)
        assert parts.m == len(roi)
        assert np.abs(parts.base - mesh.vertices[roi]).max() < 1e-8


def _radial_error(base: np.ndarray, axis: np.ndarray, radius: float) -> float:
    return float(np.sqrt(np.mean((np.linalg.norm(base * axis, axis=1) - radius) ** 2)))


def test_bumped_sphere_comes_back_clean() -> None:
    mesh = icosphere_like(8000, jitter=0.15)
    roi = np.flatnonzero(mesh.vertices[:, 2] > 0.8)
    bumps = 1 + _bumps(mesh, 0.2, 300) * (mesh.vertices[:, 2] > 0.83)
    bumped = mesh.with_vertices(mesh.vertices * bumps[:, None])
    base = decompose(bumped, roi, modes=0).base
    before = _radial_error(bumped.vertices[roi], np.ones(3), 1.0)
    assert before > 0.015
    assert _radial_error(base, np.ones(3), 1.0) < 0.5 * before


def test_bumped_cylinder_comes_back_clean() -> None:
    turn, z = (
        a.ravel()
        for a in np.meshgrid(np.arange(150) * 2 * np.pi / 150, np.linspace(0, 1, 80), indexing="ij")
    )
    out = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(150), np.arange(79), indexing="ij"))
    a, b = i * 80 + j, (i + 1) % 150 * 80 + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    mesh = Mesh(0.3 * out + np.outer(z, [0, 0, 1]), faces)
    roi = np.flatnonzero((np.abs(z - 0.5) < 0.2) & (out[:, 0] > 0.5))
    inside = (np.abs(z - 0.5) < 0.16) & (out[:, 0] > 0.6)
    bumped = mesh.with_vertices(mesh.vertices + out * (_bumps(mesh, 0.06, 900) * inside)[:, None])
    base = decompose(bumped, roi, modes=0).base
    plan = np.array([1.0, 1.0, 0.0])
    before = _radial_error(bumped.vertices[roi], plan, 0.3)
    assert before > 0.004
    assert _radial_error(base, plan, 0.3) < 0.5 * before


def _tube(length: float, bump: float = 0.0, turns: int = 60) -> tuple[Mesh, np.ndarray]:
    """Tube of radius 1 with irregular triangles and bumps; the region is `length` of it."""
    rows = int(turns * (length + 3) / (2 * np.pi) * 1.1)
    turn, z = (
        a.ravel()
        for a in np.meshgrid(
            np.arange(turns) * 2 * np.pi / turns,
            np.linspace(-1.5, length + 1.5, rows),
            indexing="ij",
        )
    )
    shaken = np.random.default_rng(0).uniform(-0.25, 0.25, (2, len(z)))
    inner = (z > -1.45) & (z < length + 1.45)
    turn, z = turn + shaken[0] * 2 * np.pi / turns * inner, z + shaken[1] * 0.1 * inner
    radius = 1 + bump * np.sin(9 * turn) * np.sin(7 * z)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(turns), np.arange(rows - 1), indexing="ij"))
    a, b = i * rows + j, (i + 1) % turns * rows + j
    faces = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    mesh = Mesh(np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z]), faces)
    return mesh, np.flatnonzero((z > 0) & (z < length))


@pytest.mark.parametrize(("bump", "within"), [(0.0, 0.01), (0.05, 0.07)])
@pytest.mark.parametrize("length", [3.0, 2 * np.pi, 12.0])
def test_a_tube_stays_a_tube(length: float, bump: float, within: float) -> None:
    mesh, roi = _tube(length, bump)
    region = Region(mesh, roi)
    flat_rule = _placed(region)
    base = decompose(mesh, roi, modes=0).base
    radius = np.hypot(base[:, 0], base[:, 1])
    assert np.hypot(flat_rule[:, 0], flat_rule[:, 1]).min() < 0.9
    assert np.abs(radius - 1).max() < within


def test_a_deep_bowl_of_a_sphere_stays_round() -> None:
    mesh = icosphere_like(6000, jitter=0.15)
    roi = np.flatnonzero(mesh.vertices[:, 2] > -0.3)
    radius = np.linalg.norm(decompose(mesh, roi, modes=0).base, axis=1)
    flat_rule = np.linalg.norm(_placed(Region(mesh, roi)), axis=1)
    assert flat_rule.min() < 0.8
    assert np.abs(radius - 1).max() < 0.02


def test_faces_wound_both_ways_have_the_plain_base() -> None:
    mesh, roi = _tube(4.0)
    faces = mesh.faces.copy()
    faces[::7] = faces[::7][:, ::-1]
    other = Mesh(mesh.vertices, faces)
    base = decompose(other, roi, modes=0).base
    assert np.abs(base - _placed(Region(other, roi))).max() < 1e-12


def test_smooth_rule_is_closer_to_the_clean_surface_where_the_rim_crosses_bumps() -> None:
    mesh = flat(6400)
    waves = 0.02 * np.sin(40 * mesh.vertices[:, 0]) * np.sin(37 * mesh.vertices[:, 1])
    bumped = lifted(mesh, waves)
    roi = _disc(mesh, 0.35)
    error = {
        rim: np.sqrt(np.mean(decompose(bumped, roi, modes=0, rim=rim).base[:, 2] ** 2))
        for rim in ("smooth", "paper")
    }
    features = np.sqrt(np.mean(waves[roi] ** 2))
    assert error["smooth"] < features
    assert error["smooth"] < error["paper"]


@pytest.mark.parametrize("rim", ["smooth", "paper"])
def test_residual_of_its_equations_is_zero(rim: Literal["smooth", "paper"]) -> None:
    mesh = icosphere_like(3000)
    region = Region(mesh, ball(mesh, 500))
    factor = factorise(region.stiffness_roi)
    m, near = region.m, region.m + len(region.rim)
    x = region.x.copy()
    x[:m] = Plate(region).plain() if rim == "smooth" else paper_base(region, factor)
    K, M = region.laplacian.stiffness, region.laplacian.areas
    delta = (K[:near] @ x) / M[:near, None]
    if rim == "paper":
        delta[m:] = (K[m:near] @ region.x) / M[m:near, None]
    # Eq. 9 on the rows of the region, beside the size of the terms that cancel there.
    left = K[:m, :near] @ delta
    assert np.abs(left).max() < 1e-8 * (abs(K[:m, :near]) @ np.abs(delta)).max()


@pytest.mark.parametrize("name", ["bunny_hr.obj", "armadillo.obj", "boot.obj"])
def test_rim_shows_no_crease(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    parts = decompose(mesh, ball(mesh, 2000), modes=0)
    moved = mesh.vertices.copy()
    moved[parts.roi] = parts.base
    before = np.percentile(dihedrals(mesh, parts.region.rim), 95)
    after = np.percentile(dihedrals(mesh.with_vertices(moved), parts.region.rim), 95)
    assert after <= before


@pytest.mark.parametrize("name", ["spot.obj", "bunny_hr.obj"])
def test_agrees_with_libigl_harmonic_of_order_two(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    region = Region(mesh, ball(mesh, 1500))
    fixed = np.setdiff1d(np.arange(mesh.n), region.roi)
    # Both with the same K; libigl's own M is that of Voronoi areas, as ours.
    theirs = igl.harmonic(mesh.vertices, mesh.faces, fixed, mesh.vertices[fixed], 2)
    ours = _placed(region)
    assert np.abs(ours - theirs[region.roi]).max() < 1e-6 * region.scale


def test_base_that_runs_away_is_refused() -> None:
    from bench import broken
    from bench.robustness import random_region
    from engine import EngineError

    mesh = broken.spikes(0)
    rng = np.random.default_rng(0)
    for _ in range(5):
        roi = random_region(mesh, rng)
        try:
            parts = decompose(mesh, roi, modes=0)
        except EngineError:
            continue
        assert np.linalg.norm(parts.base - parts.original, axis=1).max() <= parts.region.scale


def test_rim_of_a_handle_folds_hardly_more_than_the_original(shared_meshes: Path) -> None:
    mesh = real(shared_meshes, "hammer.obj")
    for roi in regions(mesh, 3, len("hammer")):
        region = Region(mesh, roi)
        folds = []
        for shape in (mesh.vertices[region.roi], _placed(region), _levelled(region)):
            x = mesh.vertices.copy()
            x[region.roi] = shape
            folds.append(float(rim_folds(mesh, x, region.roi)[1]))
        original, plain, levelled = folds
        assert levelled < 0.75 * plain
        assert levelled < 1.35 * original


def _levelled(region: Region) -> np.ndarray:
    base: np.ndarray = decompose(region.mesh, region.roi, modes=0).base
    return base
