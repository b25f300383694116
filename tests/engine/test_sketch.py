"""Targets: chord lengths, ends, end-on curves, loops, and the zigzag of the anchors (Fig. 10)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import SketchError, pressure_weights, resample_target, source_curve, tidy_stroke
from engine.arrays import F64
from engine.sketch import along, chord_lengths, smoothed

from .shapes import camera, parallel

FRONT = camera((0.0, -5.0, 0.0))


def arc(count: int = 30, seed: int = 0, rough: float = 0.0) -> F64:
    """Irregularly spaced points on an arc facing FRONT, with a zigzag of the given size."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(-0.8, 0.8, count))
    zigzag = rough * (-1.0) ** np.arange(count)
    zigzag[[0, -1]] = 0
    return np.column_stack([t, 0.2 * t**2, 0.4 * np.cos(2 * t) + zigzag])


def shares(path: F64, points: F64) -> F64:
    """Normalised length along a polyline at which each of its points `points` lies."""
    s = chord_lengths(path)
    a, ab = path[:-1], np.diff(path, axis=0)
    t = np.clip(((points[:, None] - a) * ab).sum(axis=2) / (ab**2).sum(axis=1), 0, 1)
    away = np.linalg.norm(points[:, None] - a - t[:, :, None] * ab, axis=2)
    k = away.argmin(axis=1)
    rows = np.arange(len(points))
    assert away[rows, k].max() < 1e-9
    return np.asarray((s[k] + t[rows, k] * np.diff(s)[k]) / s[-1])


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(2, 60))
def test_normalised_chord_lengths_are_equal(seed: int, count: int) -> None:
    x = arc(count, seed)
    # A target that climbs steadily, so that each of its points has one place on it.
    path = np.column_stack([np.linspace(100, 700, 25), 300 + 80 * np.sin(np.linspace(0, 3, 25))])
    target = resample_target(x, path, FRONT, carry_zigzag=False)
    s = chord_lengths(FRONT.project(x))
    assert np.abs(shares(path, target) - s / s[-1]).max() < 1e-9


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), carry=st.booleans())
def test_reversing_the_stroke_changes_nothing(seed: int, carry: bool) -> None:
    rng = np.random.default_rng(seed)
    x = arc(20, seed, rough=0.01)
    path = np.cumsum(rng.normal(size=(30, 2)) * 20 + np.array([15, 0]), axis=0) + np.array(
        [200, 400]
    )
    forward = resample_target(x, path, FRONT, carry_zigzag=carry)
    assert np.allclose(
        forward, resample_target(x, path[::-1], FRONT, carry_zigzag=carry), atol=1e-9
    )


def test_ends_meet_the_nearer_ends() -> None:
    x = arc(25, rough=0.01)
    seen = FRONT.project(x)
    path = seen[[0, -1]] + [[5.0, -30], [-8, -40]]
    for drawn in (path, path[::-1]):
        target = resample_target(x, drawn, FRONT)
        assert np.allclose(target[[0, -1]], path, atol=1e-9)


def test_a_target_on_the_source_keeps_every_anchor_where_it_is() -> None:
    x = arc(40, rough=0.02)
    drawn = tidy_stroke(FRONT.project(source_curve(x)), 0.25)
    target = resample_target(x, drawn, FRONT)
    assert np.abs(target - FRONT.project(x)).max() < 0.25
    flattened = resample_target(x, drawn, FRONT, carry_zigzag=False)
    assert np.abs(flattened - FRONT.project(x)).max() > 3.0


def test_tremor_finer_than_the_anchors_is_left_out() -> None:
    x = np.column_stack([np.linspace(-0.8, 0.8, 60), np.zeros(60), np.zeros(60)])
    across = np.linspace(200, 800, 601)
    shaken = np.column_stack([across, 300 + np.random.default_rng(2).normal(size=601)])
    calm = resample_target(x, shaken, FRONT)
    rough = resample_target(x, shaken, FRONT, carry_zigzag=False)
    assert np.std(np.diff(calm[3:-3, 1], n=2)) < 0.25 * np.std(np.diff(rough[3:-3, 1], n=2))
    assert np.abs(calm[3:-3, 1] - 300).max() < 1.0


def test_the_zigzag_is_carried_and_turned_with_the_curve() -> None:
    x = np.column_stack([np.linspace(-0.8, 0.8, 41), np.zeros(41), np.zeros(41)])
    x[1:-1, 2] = 0.02 * (-1.0) ** np.arange(39)
    upright = np.array([[500.0, 700.0], [500.0, 100.0]])
    target = resample_target(x, upright, FRONT)
    sideways = np.abs(target[5:-5, 0] - 500)
    up = np.abs(FRONT.project(x)[5:-5, 1] - 400)
    assert np.allclose(sideways, up, rtol=0.2)
    assert sideways.min() > 4


def test_smoothing_takes_the_zigzag_and_leaves_the_curve() -> None:
    smooth, rough = arc(60, rough=0.0), arc(60, rough=0.02)
    middle = slice(6, -6)
    even = (
        np.column_stack([np.linspace(0, 1, 60)] * 3) + 0.1 * np.sin(np.linspace(0, 3, 60))[:, None]
    )
    assert np.abs(source_curve(even) - even)[middle].max() < 1e-3
    assert np.abs(source_curve(rough) - source_curve(smooth))[middle].max() < 0.1 * 0.02


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 50])
@pytest.mark.parametrize("closed", [False, True])
def test_smoothing_solves_its_own_equations(count: int, closed: bool) -> None:
    points = np.random.default_rng(count).normal(size=(count, 2))
    y = smoothed(points, 3.0, closed)
    if count < 4:
        assert (y == points).all()
        return
    if closed:
        D = (
            np.roll(np.eye(count), 1, axis=1)
            - 2 * np.eye(count)
            + np.roll(np.eye(count), -1, axis=1)
        )
    else:
        D = np.diff(np.eye(count), n=2, axis=0)
    gradient = (y - points) + 3.0 * D.T @ D @ y
    free = slice(None) if closed else slice(1, -1)
    assert np.abs(gradient[free]).max() < 1e-9
    if not closed:
        assert (y[[0, -1]] == points[[0, -1]]).all()


def test_a_source_seen_end_on_is_spread_by_its_length_in_space() -> None:
    y = np.array([0.0, 0.1, 0.4, 1.0])
    x = np.column_stack([np.zeros(4), y, np.zeros(4)])
    view = parallel(1, scale=2.0)
    target = resample_target(x, [[100.0, 100.0], [300.0, 100.0]], view, carry_zigzag=False)
    along_x = np.sort(target[:, 0])
    assert np.allclose(along_x, 100 + 200 * y) or np.allclose(along_x, 300 - 200 * y[::-1])


def test_a_loop_finds_start_and_direction() -> None:
    t = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = np.column_stack([0.5 * np.cos(t), np.zeros(40), 0.5 * np.sin(t)])
    seen = FRONT.project(ring)
    centre = seen.mean(axis=0)
    wanted = centre + 1.3 * (seen - centre)
    u = np.linspace(0, 2 * np.pi, 400, endpoint=False) + 1.234
    fine = FRONT.project(np.column_stack([0.5 * np.cos(u), 0 * u, 0.5 * np.sin(u)]))
    drawn = centre + 1.3 * (fine - centre)
    step = np.linalg.norm(np.diff(wanted, axis=0), axis=1).max()
    for path in (drawn, drawn[::-1]):
        target = resample_target(ring, path, FRONT, closed=True)
        assert np.linalg.norm(target - wanted, axis=1).max() < 0.2 * step


class TestStrokes:
    def test_spacing_is_even_and_ends_stay(self) -> None:
        path = np.array([[0, 0], [0, 0], [10, 0], [10, 0], [10, 20.0]])
        even = tidy_stroke(path, 2.0)
        steps = np.linalg.norm(np.diff(even, axis=0), axis=1)
        assert steps.max() < 2.0 + 1e-9
        assert (even[[0, -1]] == path[[0, -1]]).all()

    def test_tremor_goes_and_the_line_stays(self) -> None:
        x = np.arange(0, 400.0)
        shaken = np.column_stack(
            [x, 50 * np.sin(x / 100) + np.random.default_rng(0).normal(size=400)]
        )
        calm = tidy_stroke(shaken, 2.0, smoothing=6.0)
        true = 50 * np.sin(calm[:, 0] / 100)
        assert np.std(calm[5:-5, 1] - true[5:-5]) < 0.5
        assert (calm[[0, -1]] == shaken[[0, -1]]).all()

    def test_pressure_gives_weights(self) -> None:
        path = np.column_stack([np.arange(0, 101.0, 10), np.zeros(11)])
        pressure = np.concatenate([[0.0], np.linspace(0.2, 0.8, 9), [0.0]])
        anchors = np.array([[1.0, 3], [11, 0], [89, -2], [50, 1]])
        weights = pressure_weights(path, pressure, anchors)
        assert np.allclose(weights, [0.1, 0.25, 1.0, 0.625])
        assert (pressure_weights(path, np.zeros(11), anchors) == 1).all()
        with pytest.raises(SketchError):
            pressure_weights(path, pressure[:3], anchors)

    def test_points_at_lengths(self) -> None:
        path = np.array([[0, 0], [3, 4], [3, 10.0]])
        found = along(path, chord_lengths(path), np.array([0, 2.5, 5, 11]))
        assert np.allclose(found, [[0, 0], [1.5, 2], [3, 4], [3, 10]])

    @pytest.mark.parametrize(
        "bad", [[], [[1.0, 2.0]], [[1, 1], [1, 1]], [[0, np.nan], [5, 5]], [[1, 2, 3]]]
    )
    def test_no_stroke_at_all_is_refused(self, bad: list[list[float]]) -> None:
        with pytest.raises(SketchError):
            tidy_stroke(bad)
        with pytest.raises(SketchError):
            resample_target(arc(), bad, FRONT)
