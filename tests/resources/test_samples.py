"""The shipped samples are sound meshes of real size and agree with the truth beside them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from engine import Mesh
from resources import SAMPLES, features, sample_path

NAMES = list(SAMPLES)
CLOSED = [name for name in NAMES if name != "plate"]
# Largest extent of each sample in millimetres.
EXTENT = {"vase": (215, 230), "tank": (380, 420), "drill": (230, 300), "plate": (299, 301)}


@pytest.fixture(scope="module")
def mesh_of(read_ply: Callable[[Path], tuple[np.ndarray, np.ndarray]]) -> Callable[[str], Mesh]:
    return cache(lambda name: Mesh(*read_ply(sample_path(name))))


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def mesh(name: str, mesh_of: Callable[[str], Mesh]) -> Mesh:
    return mesh_of(name)


def smallest_angles(mesh: Mesh) -> np.ndarray:
    corners = mesh.vertices[mesh.faces]
    u = np.roll(corners, -1, axis=1) - corners
    v = np.roll(corners, 1, axis=1) - corners
    cosine = (u * v).sum(axis=2) / (np.linalg.norm(u, axis=2) * np.linalg.norm(v, axis=2))
    return np.degrees(np.arccos(cosine)).min(axis=1)


def test_has_10000_to_60000_vertices_in_a_small_file(name: str, mesh: Mesh) -> None:
    assert 10_000 <= mesh.n <= 60_000
    assert sample_path(name).stat().st_size < 3_000_000


def test_is_one_manifold_piece_with_no_vertex_to_spare(mesh: Mesh) -> None:
    topology = mesh.topology
    assert topology.edge_face_counts.max() == 2
    assert topology.used_vertices.all()
    assert topology.components.max() == 0


def test_the_faces_at_every_vertex_form_one_fan(mesh: Mesh) -> None:
    """Euler's formula at a vertex: one fan has as many faces as edges, one less on a border."""
    edges = np.bincount(mesh.topology.edges.ravel(), minlength=mesh.n)
    faces = np.bincount(mesh.faces.ravel(), minlength=mesh.n)
    np.testing.assert_array_equal(edges - faces, mesh.topology.border_vertices.astype(int))


def test_neighbouring_faces_turn_the_same_way(mesh: Mesh) -> None:
    i, j = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    assert len(np.unique(i * mesh.n + j)) == len(i)


@pytest.mark.parametrize("closed", CLOSED)
def test_a_closed_sample_has_no_border_and_faces_outward(
    closed: str, mesh_of: Callable[[str], Mesh]
) -> None:
    mesh = mesh_of(closed)
    assert (mesh.topology.edge_face_counts == 2).all()
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 > 0


def test_the_plate_is_open_faces_up_and_has_an_exact_outline(
    mesh_of: Callable[[str], Mesh],
) -> None:
    mesh = mesh_of("plate")
    assert (mesh.face_normals[:, 2] > 0).all()
    border = np.abs(mesh.vertices[mesh.topology.border_vertices, :2])
    on_outline = np.isclose(border[:, 0], 150, atol=1e-4) | np.isclose(border[:, 1], 100, atol=1e-4)
    assert on_outline.all()


def test_is_as_large_as_the_real_thing(name: str, mesh: Mesh) -> None:
    bounds = mesh.bounds
    low, high = EXTENT[name]
    assert low < (bounds[1] - bounds[0]).max() < high


def test_triangles_are_irregular_and_well_shaped(mesh: Mesh) -> None:
    angles = smallest_angles(mesh)
    assert angles.min() > 12
    assert np.percentile(angles, 1) > 30
    valence = np.bincount(mesh.topology.edges.ravel())[~mesh.topology.border_vertices]
    assert (valence != 6).mean() > 0.15


def test_no_two_neighbouring_faces_fold_over(mesh: Mesh) -> None:
    """Dihedral angles stay small: what is sharp in the form is a fillet in the mesh."""
    normals = mesh.face_normals / np.linalg.norm(mesh.face_normals, axis=1, keepdims=True)
    keys = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort((keys[:, 1], keys[:, 0]))
    face = np.repeat(np.arange(len(mesh.faces)), 3)[order]
    shared = (keys[order][1:] == keys[order][:-1]).all(axis=1)
    cosine = (normals[face[1:]] * normals[face[:-1]]).sum(axis=1)[shared]
    assert np.degrees(np.arccos(cosine.min())) < 100
    assert np.degrees(np.arccos(np.percentile(cosine, 1))) < 40


def test_truth_covers_every_vertex_and_names_an_editable_region(name: str, mesh: Mesh) -> None:
    truth = features(name)
    assert truth.plain.shape == (mesh.n, 3)
    assert truth.region.shape == truth.height.shape == (mesh.n,)
    assert 2_000 < truth.region.sum() < 0.8 * mesh.n
    assert (truth.featured & truth.region).sum() > 300


def test_a_vertex_is_its_height_above_the_plain_form(name: str, mesh: Mesh) -> None:
    """Away from steep flanks (the tank's cap) the distance to the plain form is the height."""
    truth = features(name)
    away = np.linalg.norm(mesh.vertices - truth.plain, axis=1)
    inside = truth.region
    assert np.abs(away - np.abs(truth.height))[inside].max() < 0.35
    assert away[~truth.featured].max() < 0.1


def test_an_unknown_name_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(KeyError, match="vase"):
        sample_path("teapot")


def test_every_sample_has_its_files_and_a_title() -> None:
    for sample, title in SAMPLES.items():
        assert sample_path(sample).is_file()
        assert title
    stored = {path.stem for path in Path(sample_path("vase")).parent.glob("*.ply")}
    assert stored == set(SAMPLES)
