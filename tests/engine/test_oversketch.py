"""A part of a target drawn anew: the part lies on the stroke, and what is before it stays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from engine import SketchError, redraw_part, tidy_stroke
from engine.arrays import F64
from engine.sketch import target_curve

from .shapes import parallel

VIEW = parallel()
COUNT = 61


def line(zigzag: float = 0.0) -> F64:
    """Anchors (c, 3) on a line of 1.5, which is 600 px, from the left to the right."""
    x = np.linspace(-0.75, 0.75, COUNT)
    y = zigzag * (-1.0) ** np.arange(COUNT)
    y[[0, -1]] = 0
    return np.column_stack([x, y, np.zeros(COUNT)])


def ring() -> F64:
    t = np.arange(COUNT) / COUNT * 2 * np.pi
    return 0.6 * np.column_stack([np.cos(t), np.sin(t), np.zeros(COUNT)])


def bulge(a: F64, b: F64, by: float) -> F64:
    """A stroke (p, 2) from a to b that leaves the straight way by so many px in its middle."""
    t = np.linspace(0, 1, 80)[:, None]
    return a + t * (b - a) + np.sin(np.pi * t) ** 2 * [0.0, by]


def away(curve: F64, path: F64) -> F64:
    """Distance (c,) px of each point of a curve from a path."""
    return np.asarray(cKDTree(tidy_stroke(path, 0.25)).query(curve)[0])


@pytest.mark.parametrize("forward", [True, False])
def test_a_part_lies_on_the_stroke_and_the_rest_stays(forward: bool) -> None:
    x = line()
    before = VIEW.project(x)
    first, last = (15, 40) if forward else (40, 15)
    stroke = bulge(before[first], before[last], 80.0)
    after = redraw_part(x, before, stroke, VIEW, first, forward)
    inside = slice(15, 41)
    # What is finer than the anchors lie apart, 10 px, counts as tremor.
    assert away(after[inside], stroke).max() < 1.0
    assert np.abs(after[:, 1] - before[:, 1]).max() > 75
    # Where old and new meet, 30 px to either side may give way a little.
    assert after[:12] == pytest.approx(before[:12], abs=1e-9)
    assert after[44:] == pytest.approx(before[44:], abs=1e-9)
    assert after[[12, 13, 14, 41, 42, 43]] == pytest.approx(
        before[[12, 13, 14, 41, 42, 43]], abs=0.5
    )
    # No anchor overtakes another, and they stay about as far apart as they were.
    steps = np.linalg.norm(np.diff(after[inside], axis=0), axis=1)
    assert steps.min() > 0.85 * steps.max()


def test_the_zigzag_of_the_anchors_is_kept() -> None:
    x = line(0.01)
    before = VIEW.project(x)
    curve = target_curve(x, before, VIEW)
    stroke = bulge(curve[10], curve[50], 60.0)
    after = redraw_part(x, before, stroke, VIEW, 10, True)
    assert away(after[12:49], stroke).min() > 2.0, "the anchors themselves go on zigzagging"
    assert away(target_curve(x, after, VIEW)[12:49], stroke).max() < 1.0


def test_what_comes_behind_goes_along_less_and_less() -> None:
    x = line()
    before = VIEW.project(x)
    end = before[30] + [0.0, -40.0]
    after = redraw_part(x, before, bulge(before[10], end, 0.0), VIEW, 10, True, reach=0.3)
    moved = np.linalg.norm(after - before, axis=1)
    behind = moved[30:]
    assert behind[0] > 30
    assert (np.diff(behind[3:]) <= 1e-9).all()
    assert behind[-1] == pytest.approx(0, abs=1e-9)


def test_a_stroke_set_down_beside_the_curve_begins_on_it() -> None:
    x = line()
    before = VIEW.project(x)
    stroke = bulge(before[10], before[50], 0.0) + np.array([0.0, 10.0])
    after = redraw_part(x, before, stroke, VIEW, 10, True)
    assert after[:8] == pytest.approx(before[:8], abs=1e-9)
    assert np.abs(after[8:11] - before[8:11]).max() < 1.5
    assert after[30, 1] - before[30, 1] == pytest.approx(10.0, abs=0.2)


@pytest.mark.parametrize("forward", [True, False])
def test_a_part_of_a_loop_may_pass_its_first_anchor(forward: bool) -> None:
    x = ring()
    before = VIEW.project(x)
    first, last = (50, 10) if forward else (10, 50)
    middle = before[0] + [60.0, 0.0]
    t = np.linspace(0, 1, 40)[:, None]
    stroke = np.vstack([before[first] * (1 - t) + middle * t, middle * (1 - t) + before[last] * t])
    after = redraw_part(x, before, stroke, VIEW, first, forward, closed=True)
    inside = [*range(50, COUNT), *range(11)]
    # A loop has no ends: its zigzag is a wave of the whole ring, and corners are a little rounded.
    assert away(after[inside], stroke).max() < 3.0
    assert after[15:46] == pytest.approx(before[15:46], abs=0.5)


def test_a_whole_loop_can_be_drawn_again() -> None:
    x = ring()
    before = VIEW.project(x)
    wider = before[[*range(COUNT), 0]] * [1.1, 1.0] - [0.1 * before[:, 0].mean(), 0.0]
    after = redraw_part(x, before, wider, VIEW, 0, True, closed=True)
    assert np.ptp(after[:, 0]) > 1.08 * np.ptp(before[:, 0])


def test_a_point_is_refused() -> None:
    x = line()
    with pytest.raises(SketchError, match="only a point"):
        redraw_part(x, VIEW.project(x), [[5.0, 5.0], [5.0, 5.0]], VIEW, 3, True)


def test_old_and_new_part_meet_without_a_corner() -> None:
    x = line()
    before = VIEW.project(x)
    first, last = before[20], before[40]
    tent = np.vstack([first, (first + last) / 2 + [0.0, -60.0], last])
    after = redraw_part(x, before, tent, VIEW, 20, True)
    way = np.diff(after, axis=0)
    turn = np.abs(np.diff(np.unwrap(np.arctan2(way[:, 1], way[:, 0]))))
    drawn = np.arctan2(60.0, 100.0)  # the corner of the stroke and the line, radians
    assert turn[15:25].max() < 0.4 * drawn
    assert turn[35:45].max() < 0.4 * drawn
    assert away(after[24:37], tent).max() < 6.0
    assert after[[0, -1]] == pytest.approx(before[[0, -1]], abs=1e-9)
