"""K, M and delta: closed forms, an independent library, and meshes that are not well shaped."""

from __future__ import annotations

from pathlib import Path

import igl
import numpy as np
import pytest
import scipy.sparse as sp

from bench import broken
from engine import Mesh, cotangent_stiffness, mean_curvature, vertex_areas
from engine.operators import laplacian, laplacian_coordinates, robust
from tests.engine.surfaces import flat, icosphere_like, interior, real


def _obtuse_sheet() -> Mesh:
    mesh = flat(400)
    return mesh.with_vertices(mesh.vertices * [1.0, 0.15, 1.0])


@pytest.mark.parametrize("mesh", [icosphere_like(500), flat(400), _obtuse_sheet()])
def test_rows_of_the_stiffness_sum_to_zero_and_it_is_semidefinite(mesh: Mesh) -> None:
    K = cotangent_stiffness(mesh)
    assert abs(K - K.T).max() == 0
    assert np.abs(K @ np.ones(mesh.n)).max() < 1e-12
    assert np.linalg.eigvalsh(K.toarray()).min() > -1e-12


def test_delta_of_linear_functions_in_the_plane_is_zero() -> None:
    mesh = flat(400)
    delta = laplacian_coordinates(cotangent_stiffness(mesh), vertex_areas(mesh), mesh.vertices)
    assert np.abs(delta[interior(mesh)]).max() < 1e-9


def test_equilateral_weights_give_the_vertex_minus_the_mean_of_its_neighbours() -> None:
    turn = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(6)])
    mesh = Mesh(np.vstack([[0, 0, 0], ring]), [[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
    lifted = mesh.vertices + [[0, 0, 0.3]] * np.array([[1]] + [[0]] * 6)
    row = cotangent_stiffness(mesh)[[0]] @ lifted
    weight = 6 / np.sqrt(3)
    assert row[0] / weight == pytest.approx(lifted[0] - lifted[1:].mean(axis=0), abs=1e-14)


@pytest.mark.parametrize("radius", [0.01, 1.0, 40.0])
def test_sphere_has_twice_its_mean_curvature_along_its_normal(radius: float) -> None:
    mesh = icosphere_like(20_000, radius, jitter=0.1)
    delta = laplacian_coordinates(cotangent_stiffness(mesh), vertex_areas(mesh), mesh.vertices)
    length = np.linalg.norm(delta, axis=1)
    cosine = np.einsum("ij,ij->i", delta, mesh.vertices) / (length * radius)
    share_of_area = vertex_areas(mesh) / vertex_areas(mesh).sum()
    assert radius * length @ share_of_area == pytest.approx(2, rel=0.01)
    assert np.percentile(np.degrees(np.arccos(np.clip(cosine, -1, 1))), 99) < 1
    assert radius * mean_curvature(mesh) @ share_of_area == pytest.approx(1, rel=0.01)


def test_a_vertex_in_no_face_has_no_curvature() -> None:
    ball = icosphere_like(500)
    mesh = Mesh(np.vstack([ball.vertices, [[9.0, 9.0, 9.0]]]), ball.faces)
    curvature = mean_curvature(mesh)
    assert curvature[-1] == 0
    assert (curvature[:-1] == mean_curvature(ball)).all()
    K, M = robust(mesh.vertices, mesh.faces)
    assert M[-1] == 0
    assert abs(K[[-1]]).max() == 0


def test_regular_sphere_is_right_at_every_vertex() -> None:
    v, f = igl.icosahedron() if hasattr(igl, "icosahedron") else _icosahedron()
    for _ in range(5):
        v, f = igl.loop(v, f)
    v = v / np.linalg.norm(v, axis=1, keepdims=True)
    mesh = Mesh(3 * v, f)
    delta = laplacian_coordinates(cotangent_stiffness(mesh), vertex_areas(mesh), mesh.vertices)
    length = np.linalg.norm(delta, axis=1)
    cosine = np.einsum("ij,ij->i", delta, v) / length
    assert np.abs(3 * length - 2).max() < 0.02
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 1


def _icosahedron() -> tuple[np.ndarray, np.ndarray]:
    mesh = icosphere_like(12, jitter=0.0)
    return mesh.vertices, mesh.faces


@pytest.mark.parametrize("mesh", [icosphere_like(500, 7.0), flat(400), _obtuse_sheet()])
def test_areas_sum_to_the_surface(mesh: Mesh) -> None:
    surface = np.linalg.norm(mesh.face_normals, axis=1).sum() / 2
    assert vertex_areas(mesh).sum() == pytest.approx(surface, rel=1e-12)


def test_areas_of_one_obtuse_triangle_are_half_and_quarters() -> None:
    mesh = Mesh([[0, 0, 0], [4, 0, 0], [1, 0.5, 0]], [[0, 1, 2]])
    assert vertex_areas(mesh) == pytest.approx([0.25, 0.25, 0.5])


@pytest.mark.parametrize("name", ["spot.obj", "wingnut.obj", "hammer.obj"])
def test_agrees_with_libigl_on_real_meshes(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    theirs = -sp.csr_array(igl.cotmatrix(mesh.vertices, mesh.faces))
    K = cotangent_stiffness(mesh)
    assert abs(K - theirs).max() <= 1e-10 * abs(theirs).max()
    masses = igl.massmatrix(mesh.vertices, mesh.faces, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    assert np.abs(vertex_areas(mesh) - masses).max() <= 1e-10 * masses.max()


@pytest.mark.parametrize("kind", list(broken.KINDS))
def test_broken_meshes_give_a_finite_semidefinite_laplacian(kind: str) -> None:
    mesh = broken.KINDS[kind](0)
    x = (mesh.vertices - mesh.bounds[0]) / mesh.diagonal
    found = laplacian(x, mesh.faces)
    assert np.isfinite(found.stiffness.data).all()
    assert (found.areas > 0).all()
    scale = np.abs(found.stiffness.diagonal()).max()
    lowest = np.linalg.eigvalsh(found.stiffness.toarray())[0]
    assert lowest > -1e-10 * scale


def test_well_shaped_mesh_keeps_plain_cotangents_and_says_nothing() -> None:
    mesh = icosphere_like(500)
    found = laplacian(mesh.vertices, mesh.faces)
    assert found.report == ""
    assert abs(found.stiffness - cotangent_stiffness(mesh)).max() == 0


@pytest.mark.parametrize(
    ("kind", "word"), [("needles", "needles"), ("collinear", "no area"), ("slivers", "slivers")]
)
def test_fall_back_is_said(kind: str, word: str) -> None:
    mesh = broken.KINDS[kind](0)
    found = laplacian(mesh.vertices, mesh.faces)
    assert word in found.report
    off = found.stiffness - sp.diags_array(found.stiffness.diagonal())
    assert off.data.max() < 1e-6 * np.abs(found.stiffness.diagonal()).max()
