"""The level in the window: its panel, its curve, a click on a bump, modes that swing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

from app.window import Window
from plugins.feature import missing_at
from tests.app.designing import modes, region, rest, seen, typed
from tests.app.driving import LEFT, NONE, picture

pytestmark = pytest.mark.window


def test_without_a_region_the_level_leaves_its_room_to_the_steps(
    make_window, sphere, qtbot
) -> None:
    window = make_window(sphere, size=(1180, 800))
    level, bar = window.level, window.body.side.verticalScrollBar()
    assert not level.histogram.isVisible()
    assert not window.edit.amount.isEnabled()
    tall = window.steps.tree.height()
    region(window, qtbot)
    assert level.histogram.isVisible()
    assert level.curve.isVisible()
    QApplication.processEvents()
    assert window.steps.tree.height() < tall
    assert bar.maximum() == 0, "all three panels are in sight"
    rows = window.steps.tree
    last = rows.visualItemRect(rows.topLevelItem(rows.topLevelItemCount() - 1))
    assert last.bottom() <= rows.viewport().height(), "what was done last is in sight"


def test_a_press_on_the_curve_takes_that_many_modes(window: Window, qtbot) -> None:
    session, level = window.session, window.level
    region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    qtbot.waitUntil(lambda: len(level.curve._counts) > 0)
    base = session.shown.vertices
    for share in (0.6, 0.1):
        x = round(8.5 + share * (level.curve.width() - 17))
        qtbot.mouseClick(level.curve, LEFT, NONE, QPoint(x, 20))
        k = known.mode_count(session.document.draft.level)
        assert k == pytest.approx(share * known.k, abs=0.01 * known.k + 2)
        assert level.modes.text().startswith(f"{k:,} of")
    assert (session.shown.vertices != base).any(), "the form follows"
    qtbot.waitUntil(lambda: level.histogram.cutoff == pytest.approx(known.cutoff(k)))
    assert window.viewport.scene._ghost is not None, "the original is seen where it differs"


def test_a_click_on_a_bump_sets_the_level_below_it(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    roi = region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    # The vertex of the region that stands farthest off the base, away from the rim.
    height = np.linalg.norm(known.original - known.base, axis=1)
    at = seen(window, known.roi)
    middle = np.array([view.width() / 2, view.height() / 2])
    height[np.linalg.norm(at - middle, axis=1) > 0.12 * view.height()] = 0
    bump = int(height.argmax())
    qtbot.keyClick(view, Qt.Key.Key_E)
    assert window.toolhost.active.id == "feature"
    qtbot.mouseClick(view, LEFT, NONE, QPoint(*at[bump].round().astype(int)))
    rest(window, qtbot)
    level = session.document.draft.level
    k = known.mode_count(level)
    assert 0 < k < known.k
    near = np.append(session.document.mesh.topology.adjacency[[roi[bump]]].indices, roi[bump])
    gone = missing_at(known, np.flatnonzero(np.isin(known.roi, near)))
    assert gone[k] > 0.5 * gone[0], "the bump is gone"
    assert gone[min(4 * k, known.k)] < gone[k], "and comes with finer detail"
    assert window.toolhost.active.id == "source", "the flow goes on"


def test_a_mode_swings_at_a_click(window: Window, qtbot, artefacts: Path) -> None:
    level, view = window.level, window.viewport
    roi = region(window, qtbot)
    modes(window, qtbot)
    qtbot.mouseClick(level.modes_button, LEFT)
    typed(qtbot, level.mode, "4")
    assert window.modes.playing
    assert "building block" in window.hint.text
    base = window.session.decomposition.base
    heard: list[float] = []

    def both_ways() -> bool:
        way = view.vertices[roi] - base
        heard.append(float((way * window.session.document.mesh.vertex_normals[roi]).sum()))
        return min(heard) < 0 < max(heard)

    qtbot.waitUntil(both_ways)
    qtbot.mouseClick(level.play, LEFT)
    still = view.vertices.copy()
    QApplication.processEvents()
    assert (view.vertices == still).all()
    picture(window, artefacts, "mode 4")
    qtbot.mouseClick(level.modes_button, LEFT)
    assert window.modes.mode is None
    assert (view.vertices == window.session.shown.vertices).all()
    assert "draw a curve" in window.hint.text
