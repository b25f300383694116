"""A target with few anchors is drawn where it was drawn, in its view and in depth."""

from __future__ import annotations

import numpy as np
import pytest

from app.stage import on_picture_plane
from engine import Stroke, look_at, resample_target, source_curve

VIEW = look_at((0, 0, 0), 300.0, 0.0, 0.0, (800, 600))


def ring(count: int, radius: float) -> np.ndarray:
    """A circle that leans back, facing the eye."""
    t = 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(t), 0.8 * np.sin(t), np.sin(t)])


@pytest.mark.parametrize("count", [8, 12, 20, 40, 200])
def test_a_ring_is_as_large_as_it_was_drawn(count: int) -> None:
    anchors = ring(count, 20.0)
    assert size(source_curve(anchors, closed=True)) == pytest.approx(size(anchors), rel=0.03)
    drawn = VIEW.project(ring(300, 30.0))
    target = resample_target(anchors, drawn, VIEW, closed=True)
    stroke = Stroke(np.arange(count), VIEW, target, closed=True)
    line = on_picture_plane(stroke, anchors)
    assert size(VIEW.project(line)) == pytest.approx(size(drawn), rel=0.03)
    assert np.ptp(VIEW.depth(line)) == pytest.approx(np.ptp(VIEW.depth(anchors)), rel=0.1)


@pytest.mark.parametrize("count", [5, 9, 15, 60])
def test_a_bow_is_as_high_as_it_was_drawn(count: int) -> None:
    x = np.linspace(-30, 30, count)
    anchors = np.column_stack([x, np.zeros(count), np.zeros(count)])
    t = np.linspace(-1, 1, 100)
    bow = np.column_stack([30 * t, np.zeros(100), 20 * (1 - t**2)])
    drawn = VIEW.project(bow)
    target = resample_target(anchors, drawn, VIEW)
    line = VIEW.project(on_picture_plane(Stroke(np.arange(count), VIEW, target), anchors))
    assert np.ptp(line[:, 1]) == pytest.approx(np.ptp(drawn[:, 1]), rel=0.06)


def size(points: np.ndarray) -> float:
    """Root mean square distance from the middle."""
    away = points - points.mean(axis=0)
    return float(np.sqrt((away**2).sum(axis=1).mean()))
