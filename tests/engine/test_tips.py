"""Tips of a target: the anchors reach them, and what is round or shaky has none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from engine import resample_target
from engine.arrays import F64
from engine.sketch import chord_lengths
from engine.tips import drawn_to, tips
from tests.engine.shapes import parallel

VIEW = parallel(0)


def lifted(px: F64) -> F64:
    """Points (c, 3) that are seen at px (c, 2)."""
    start = VIEW.project(np.zeros((1, 3)))
    axes = VIEW.project(np.eye(3)) - start
    return np.asarray(np.linalg.lstsq(axes.T, (px - start).T, rcond=None)[0].T)


def row(count: int, step: float) -> F64:
    """Anchors on a straight line, `step` px apart."""
    return lifted(np.column_stack([100 + step * np.arange(count), np.full(count, 300.0)]))


def tent(length: float, apex: float = 0.47) -> F64:
    """A path of two straight parts that meet at (100 + apex length, 240)."""
    u = np.linspace(0, 1, 301)
    return np.column_stack([100 + length * u, 300 - np.interp(u, [0, apex, 1], [0, 60, 0])])


def square() -> F64:
    corners = np.array([[-80, -80], [80, -80], [80, 80], [-80, 80], [-80, -80.0]]) + 210
    at = np.linspace(0, 4, 600, endpoint=False)
    return np.column_stack([np.interp(at, range(5), column) for column in corners.T])


@pytest.mark.parametrize(("count", "step"), [(15, 15.0), (30, 8.0), (60, 4.0)])
@pytest.mark.parametrize("backwards", [False, True])
def test_the_target_reaches_a_tip(count: int, step: float, backwards: bool) -> None:
    path = tent((count - 1) * step)
    target = resample_target(row(count, step), path[::-1] if backwards else path, VIEW)
    tip = path[np.argmin(path[:, 1])]
    assert np.linalg.norm(target - tip, axis=1).min() < 0.5
    assert cKDTree(path).query(target)[0].max() < 0.75
    assert (np.diff(target[:, 0]) > 0).all(), "no sample overtakes another"


@pytest.mark.parametrize("backwards", [False, True])
def test_a_loop_reaches_its_corners(backwards: bool) -> None:
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = lifted(210 + 70 * np.column_stack([np.cos(angle), np.sin(angle)]))
    path = square()[::-1] if backwards else square()
    target = resample_target(ring, path, VIEW, closed=True)
    for corner in square()[::150]:
        assert np.linalg.norm(target - corner, axis=1).min() < 0.75


def test_a_tip_is_where_it_was_drawn_shaking_or_not() -> None:
    rng = np.random.default_rng(5)
    path = tent(300.0)
    shaky = path + rng.normal(scale=0.7, size=path.shape)
    target = resample_target(row(40, 300 / 39), shaky, VIEW)
    apex = path[np.argmin(path[:, 1])]
    assert np.linalg.norm(target - apex, axis=1).min() < 2.0


def test_a_circle_and_an_arc_have_no_tips() -> None:
    angle = np.linspace(0, 2 * np.pi, 189, endpoint=False)
    circle = 30 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert len(tips(circle, circle, 8.0, closed=True)) == 0
    assert len(tips(circle[:90], circle[:90], 8.0)) == 0


def test_the_nearest_sample_lies_on_the_tip_and_the_others_keep_their_order() -> None:
    at = np.linspace(0, 100, 11)
    moved = drawn_to(at, np.array([34.0, 61.0]), 100.0)
    assert moved[[0, 3, 6, 10]] == pytest.approx([0, 34, 61, 100])
    assert (np.diff(moved) > 0).all()
    turned = np.mod(np.linspace(0, 100, 10, endpoint=False) + 55, 100)
    loop = drawn_to(turned, np.array([2.0]), 100.0, closed=True)
    assert np.abs(np.mod(loop, 100.0) - 2.0).min() < 1e-9


def test_no_tip_changes_nothing() -> None:
    at = chord_lengths(row(9, 10.0))
    assert drawn_to(at, np.zeros(0), at[-1]) is at
