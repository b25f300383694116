"""The charts of the level in the window: the cutoff is dragged; a mode swings as far as wanted."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

from app.window import Window
from tests.app.designing import modes, region
from tests.app.driving import LEFT, NONE

pytestmark = pytest.mark.window


def test_the_cutoff_is_dragged_and_the_level_follows(window: Window, qtbot) -> None:
    session, chart = window.session, window.level.histogram
    region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    qtbot.waitUntil(lambda: chart.cutoff is not None)

    def place(cutoff: float) -> QPoint:
        share = cutoff / (2.2 * known.cutoff(known.m))
        return QPoint(round(8.5 + share * (chart.width() - 17)), 20)

    low, high = known.cutoff(0), known.cutoff(known.m)
    wanted = [low + share * (high - low) for share in (0.3, 0.7)]
    apart = (high - low) / (place(high).x() - place(low).x())  # one pixel
    qtbot.mousePress(chart, LEFT, NONE, place(known.cutoff(0)))
    counts = []
    for cutoff in wanted:
        qtbot.mouseMove(chart, place(cutoff))
        k = known.mode_count(session.document.draft.level)
        counts.append(k)
        assert known.cutoff(k) >= cutoff - apart
        assert known.cutoff(k - 1) <= cutoff + apart, "and no more modes than that needs"
        qtbot.waitUntil(lambda: chart.cutoff == pytest.approx(known.cutoff(counts[-1])))
    qtbot.mouseRelease(chart, LEFT, NONE, place(wanted[-1]))
    assert 0 < counts[0] < counts[1]


def test_a_mode_swings_as_far_as_wanted(make_window, sphere, qtbot) -> None:
    window = make_window(sphere, size=(1180, 800))
    level, view = window.level, window.viewport
    roi = region(window, qtbot)
    modes(window, qtbot)
    qtbot.mouseClick(level.modes_button, LEFT)
    qtbot.mouseClick(level.play, LEFT)  # it stands still, at the end of its swing
    base = window.session.decomposition.base
    bar = window.body.side.verticalScrollBar()
    qtbot.waitUntil(lambda: bar.maximum() == 0)  # the steps stay in sight

    def far() -> float:
        return float(np.linalg.norm(view.vertices[roi] - base, axis=1).max())

    before = far()
    level.swing.setFocus()
    qtbot.keyClick(level.swing, Qt.Key.Key_End)
    assert far() == pytest.approx(before * window.modes.reach / 0.05, rel=0.01)
    assert far() > 3 * before
