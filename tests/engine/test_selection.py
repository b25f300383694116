"""Grown, shrunk, inverted and smoothed regions of a plate of squares cut in two."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from engine import Mesh
from engine.selection import (
    connected_to,
    grown,
    inverted,
    seen_through,
    shrunk,
    smoothed_border,
    without_specks,
)
from engine.view import look_at

N = 21


@pytest.fixture(scope="module")
def plate() -> Mesh:
    x, y = np.meshgrid(np.arange(float(N)), np.arange(float(N)))
    i = np.arange(N * N).reshape(N, N)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), faces)


def disc(mesh: Mesh, radius: float) -> np.ndarray:
    middle = np.array([N // 2, N // 2, 0])
    return np.flatnonzero(np.linalg.norm(mesh.vertices - middle, axis=1) <= radius)


def test_growing_adds_the_next_ring(plate: Mesh) -> None:
    one = grown(plate.topology, np.array([N * 10 + 10]))
    assert len(one) == 7, "six neighbours in this triangulation, and itself"
    roi = disc(plate, 4)
    assert set(roi) < set(grown(plate.topology, roi)) < set(grown(plate.topology, roi, 2))


def test_shrinking_takes_the_border(plate: Mesh) -> None:
    roi = disc(plate, 4)
    small = shrunk(plate.topology, roi)
    assert set(grown(plate.topology, small)) <= set(roi)
    assert len(shrunk(plate.topology, np.array([5]))) == 0


def test_inverting_twice_gives_the_region(plate: Mesh) -> None:
    roi = disc(plate, 4)
    other = inverted(plate.topology, roi)
    assert len(roi) + len(other) == plate.n
    assert (inverted(plate.topology, other) == roi).all()


def test_smoothing_takes_teeth_and_fills_bays(plate: Mesh) -> None:
    roi = disc(plate, 6)
    tooth, bay = N * 10 + 18, N * 10 + 10
    rough = np.setdiff1d(np.append(roi, tooth), [bay])
    smooth = smoothed_border(plate.topology, rough)
    assert tooth not in smooth
    assert bay in smooth
    assert len(np.setxor1d(smooth, roi)) < 0.2 * len(roi)


def test_specks_left_out_all_around_are_taken(plate: Mesh) -> None:
    roi = disc(plate, 7.2)
    hole = np.array([N * 10 + 10, N * 10 + 11])
    assert np.isin(hole, roi).all()
    torn = np.setdiff1d(roi, hole)
    share = 2 / len(torn)
    assert (without_specks(plate.topology, torn, share) == roi).all()
    assert (without_specks(plate.topology, torn, 0.9 * share) == torn).all(), "not a speck"
    two = Mesh(
        np.vstack([plate.vertices, plate.vertices[:3] + 100]),
        np.vstack([plate.faces, [[len(plate.vertices) + k for k in range(3)]]]),
    )
    assert (without_specks(two.topology, torn, 0.9) == roi).all(), "another part stays out"


@pytest.mark.parametrize("seed", range(8))
def test_specks_are_those_of_the_whole_graph(plate: Mesh, seed: int) -> None:
    dice = np.random.default_rng(seed)
    roi = np.flatnonzero(dice.random(plate.n) < (0.45, 0.6, 0.75, 0.9)[seed % 4])
    rest = np.setdiff1d(np.arange(plate.n), roi)
    parts = connected_components(plate.topology.adjacency[rest][:, rest], directed=False)[1]
    sizes = np.bincount(parts)[parts]
    for share in (0.0, 2 / len(roi), 0.03, 2.0):
        expected = np.union1d(roi, rest[sizes <= share * len(roi)])
        assert (without_specks(plate.topology, roi, share) == expected).all()


def test_inverting_stays_on_the_parts_that_the_region_touches(plate: Mesh) -> None:
    both = Mesh(
        np.concatenate([plate.vertices, plate.vertices + np.array([90, 0, 0]), [[0, 0, 9]]]),
        np.concatenate([plate.faces, plate.faces + plate.n]),
    )
    roi = np.array([3, 4, 40])
    assert set(inverted(both.topology, roi)) == set(range(plate.n)) - set(roi.tolist())


def test_an_open_border_is_no_border_of_the_region(plate: Mesh) -> None:
    half = np.flatnonzero(plate.vertices[:, 0] <= 10)
    smaller = shrunk(plate.topology, half, 3)
    assert (smaller == np.flatnonzero(plate.vertices[:, 0] <= 7)).all()


def test_only_what_hangs_together_is_taken(plate: Mesh) -> None:
    two = np.union1d(np.arange(5), np.arange(N * 4, N * 4 + 6))
    assert (connected_to(plate.topology, two, 2) == np.arange(5)).all()
    assert len(connected_to(plate.topology, two, N)) == 0


def test_what_lies_behind_the_region_is_taken_too(plate: Mesh) -> None:
    """Two plates above each other, seen from above: a disc on the upper one takes its shadow."""
    below = plate.vertices - np.array([0, 0, 3.0])
    both = Mesh(
        np.concatenate([plate.vertices, below]),
        np.concatenate([plate.faces, plate.faces + plate.n]),
    )
    view = look_at((N / 2, N / 2, 0), 4000, 0, 90, (800, 800), angle=0.5)
    roi = disc(plate, 6)
    taken = seen_through(both, roi, view)
    assert set(roi) <= set(taken)
    lower = taken[taken >= plate.n] - plate.n
    inner, outer = disc(plate, 5), disc(plate, 7.5)
    assert set(inner) <= set(lower)
    assert set(lower) <= set(outer)


@pytest.mark.parametrize("count", [0, 3, 40, 400])
def test_the_faces_about_some_vertices_are_those_with_a_corner_there(
    plate: Mesh, count: int
) -> None:
    ids = np.random.default_rng(count).permutation(plate.n)[:count]
    expected = np.flatnonzero(np.isin(plate.faces, ids).any(axis=1))
    assert (plate.topology.faces_about(ids) == expected).all()
