"""Grown, shrunk, inverted and smoothed regions of a plate of squares cut in two."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Mesh
from engine.selection import grown, inverted, shrunk, smoothed_border

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
