"""Regions grown, shrunk, inverted and smoothed."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Mesh
from engine.region_shapes import grow, invert, rings_of, shrink, smooth_border


def grid(side: int = 31, jitter: float = 0.0) -> Mesh:
    """A flat plate of side x side vertices, 1 mm apart."""
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float))
    i = np.arange(side * side).reshape(side, side)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    flat = np.column_stack([x.ravel(), y.ravel()]) + jitter * rng.uniform(-1, 1, (side**2, 2))
    return Mesh(np.column_stack([flat, np.zeros(side * side)]), faces)


def test_growing_one_vertex_gives_its_neighbours_and_shrinking_gives_it_back() -> None:
    mesh = grid()
    middle = np.array([15 * 31 + 15])
    ring = grow(mesh, middle)
    neighbours = mesh.topology.adjacency[middle].indices
    assert set(ring) == {*neighbours.tolist(), *middle.tolist()}
    assert (shrink(mesh, ring) == middle).all()
    assert (shrink(mesh, grow(mesh, middle, 4), 4) == middle).all()
    assert len(shrink(mesh, middle)) == 0


def test_rings_are_counted_along_edges() -> None:
    mesh = grid()
    from scipy.sparse.csgraph import dijkstra

    start = np.array([200, 700])
    away = dijkstra(mesh.topology.adjacency, indices=start, min_only=True, unweighted=True)
    assert (grow(mesh, start, 5) == np.flatnonzero(away <= 5)).all()


def test_an_open_border_is_no_border_of_the_region() -> None:
    mesh = grid()
    half = np.flatnonzero(mesh.vertices[:, 0] <= 10)
    smaller = shrink(mesh, half, 3)
    assert (smaller == np.flatnonzero(mesh.vertices[:, 0] <= 7)).all()


def test_inverting_stays_on_the_parts_that_the_region_touches() -> None:
    one = grid(9)
    both = Mesh(
        np.concatenate([one.vertices, one.vertices + np.array([20, 0, 0]), [[0, 0, 9]]]),
        np.concatenate([one.faces, one.faces + one.n]),
    )
    roi = np.array([3, 4, 40])
    other = invert(both, roi)
    assert set(other) == set(range(one.n)) - set(roi.tolist())
    assert (invert(both, other) == roi).all()


def test_smoothing_takes_teeth_off_and_leaves_a_straight_border() -> None:
    mesh = grid(61)
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    straight = np.flatnonzero(x <= 30)
    moved = np.setxor1d(smooth_border(mesh, straight), straight)
    # Only where the triangulation is lopsided, at the ends on the open border.
    assert len(moved) <= 2
    teeth = np.flatnonzero(x <= 30 + 3 * ((y.astype(int) // 2) % 2))
    smooth = smooth_border(mesh, teeth, 20)

    def border(roi: np.ndarray) -> int:
        inside = np.isin(np.arange(mesh.n), roi)
        e = mesh.topology.edges
        return int((inside[e[:, 0]] != inside[e[:, 1]]).sum())

    assert border(smooth) < 0.7 * border(teeth)
    assert abs(len(smooth) - len(teeth)) < 0.05 * len(teeth)


@pytest.mark.parametrize("rounds", [1, 4, 60])
def test_a_region_is_never_smoothed_away(rounds: int) -> None:
    mesh = grid(jitter=0.2)
    spot = np.array([500])
    assert (smooth_border(mesh, spot, rounds) == spot).all()
    disc = np.flatnonzero(((mesh.vertices[:, :2] - 15) ** 2).sum(axis=1) <= 64)
    again = smooth_border(mesh, disc, rounds)
    assert len(np.setxor1d(disc, again)) < 0.35 * len(disc)


def test_a_step_is_as_wide_on_a_fine_mesh_as_on_a_coarse_one() -> None:
    coarse = grid(31)
    fine = Mesh(grid(121).vertices / 4, grid(121).faces)
    a, b = rings_of(coarse, 0.1), rings_of(fine, 0.1)
    assert b == pytest.approx(4 * a, abs=2)
    assert rings_of(coarse, 0.0) == 1
