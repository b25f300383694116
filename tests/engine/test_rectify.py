"""Local rotations: rigid motion recovered, proper always, flat and degenerate rings too (18-20)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from engine import Mesh, cotangent_stiffness
from engine.arrays import F64
from engine.rectify import nearest_rotations, ring_products, ring_rotations, turned

from .shapes import plate, sphere, tube

MESHES = {
    "flat": plate(15),
    "wavy": plate(15, wave=0.05),
    "sphere": sphere(2),
    "tube": tube(20, 12),
    "needles": Mesh(plate(12).vertices * [1, 1e-5, 1], plate(12).faces),
}


def degrees_between(found: F64, true: F64) -> F64:
    apart = np.linalg.norm(found - true, axis=(1, 2)) / np.sqrt(8)
    return np.asarray(np.degrees(2 * np.arcsin(np.minimum(apart, 1))))


@pytest.mark.parametrize("name", MESHES)
@settings(max_examples=25, deadline=None)
@given(vector=st.tuples(*[st.floats(-3, 3)] * 3), shift=st.floats(-1e3, 1e3))
def test_a_rigid_motion_is_recovered(
    name: str, vector: tuple[float, float, float], shift: float
) -> None:
    mesh = MESHES[name]
    true = Rotation.from_rotvec(vector)
    G = ring_products(mesh.vertices, cotangent_stiffness(mesh), np.arange(mesh.n))
    R = ring_rotations(G, mesh.vertices @ true.as_matrix().T + shift)
    # A shift by a thousand diagonals takes three digits from the positions themselves.
    limit = 1e-6 if name != "needles" else 1e-2
    assert degrees_between(R, true.as_matrix()).max() < limit * max(1.0, abs(shift))
    if shift == 0:
        assert degrees_between(R, true.as_matrix()).max() < 1e-6


@pytest.mark.parametrize("name", MESHES)
def test_without_shift_below_a_millionth_of_a_degree(name: str) -> None:
    mesh = MESHES[name]
    true = Rotation.from_rotvec([0.4, -2.1, 1.3])
    G = ring_products(mesh.vertices, cotangent_stiffness(mesh), np.arange(mesh.n))
    R = ring_rotations(G, mesh.vertices @ true.as_matrix().T)
    assert degrees_between(R, true.as_matrix()).max() < 1e-6


@settings(max_examples=200, deadline=None)
@given(
    entries=st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    stretch=st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(-1, 1)),
)
def test_rotations_are_proper_and_the_best(
    entries: list[float], stretch: tuple[float, float, float]
) -> None:
    random = np.array(entries).reshape(3, 3)
    u, _, vt = np.linalg.svd(random + np.diag([1.3, 1.2, 1.1]))
    for B in (random, u @ np.diag(stretch) @ vt):
        R = nearest_rotations(B[None])[0]
        assert np.linalg.det(R) == pytest.approx(1, abs=1e-9)
        assert np.allclose(R @ R.T, np.eye(3), atol=1e-9)
        s = np.linalg.svd(B, compute_uv=False)
        best = s[0] + s[1] + np.sign(np.linalg.det(B)) * s[2]
        assert np.trace(R.T @ B) == pytest.approx(best, abs=1e-9 + 1e-7 * s[0])


def test_inverted_rings_give_proper_rotations() -> None:
    mesh = MESHES["sphere"]
    G = ring_products(mesh.vertices, cotangent_stiffness(mesh), np.arange(mesh.n))
    for change in ([-1, 1, 1], [-1, -1, -1], [1, 0, 1], [0, 0, 1], [0, 0, 0]):
        R = ring_rotations(G, mesh.vertices * np.array(change, dtype=float))
        assert np.allclose(np.linalg.det(R), 1, atol=1e-9)


def test_a_noisy_flat_ring_keeps_its_direction() -> None:
    mesh = plate(30)
    noise = np.random.default_rng(3).normal(scale=2e-4, size=mesh.vertices.shape)
    noisy = mesh.vertices + noise
    G = ring_products(noisy, cotangent_stiffness(mesh), np.arange(mesh.n))
    true = Rotation.from_rotvec([0.3, 0.9, -0.4])
    other = np.random.default_rng(4).normal(scale=2e-4, size=mesh.vertices.shape)
    R = ring_rotations(G, (mesh.vertices + other) @ true.as_matrix().T)
    assert np.median(degrees_between(R, true.as_matrix())) < 1.2


def test_vectors_are_turned_each_by_its_own_rotation() -> None:
    R = Rotation.from_rotvec(np.random.default_rng(0).normal(size=(5, 3)))
    v = np.random.default_rng(1).normal(size=(5, 3))
    assert np.allclose(turned(R.as_matrix(), v), R.apply(v))


def test_many_rotations_agree_with_the_decomposition() -> None:
    B = np.random.default_rng(5).normal(size=(500, 3, 3))
    u, _, vt = np.linalg.svd(B)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    assert np.allclose(nearest_rotations(B), u @ vt, atol=1e-10)
