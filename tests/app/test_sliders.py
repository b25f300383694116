"""Sliders under a mouse: the level, the smallest feature, the amount; the ghost meanwhile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QSlider, QStyle, QStyleOptionSlider

from app.window import Window
from tests.app.designing import curve, modes, region, rest
from tests.app.driving import NONE, picture, pixels

pytestmark = pytest.mark.window

LEFT = Qt.MouseButton.LeftButton


def handle(slider: QSlider) -> QPoint:
    """Where the handle of a slider is."""
    option = QStyleOptionSlider()
    slider.initStyleOption(option)
    control = QStyle.ComplexControl.CC_Slider
    part = QStyle.SubControl.SC_SliderHandle
    return slider.style().subControlRect(control, option, part, slider).center()


def dragged(slider: QSlider, share: float) -> None:
    """Take the handle of a slider with the mouse, and let go at a share of its way."""
    start = handle(slider)
    end = QPoint(round(share * (slider.width() - 1)), start.y())
    QTest.mousePress(slider, LEFT, NONE, start)
    for k in range(1, 9):
        QTest.mouseMove(slider, start + (end - start) * k / 8)
    QTest.mouseRelease(slider, LEFT, NONE, end)


def test_the_level_is_dragged_and_the_ghost_shows_the_original(
    window: Window, qtbot, artefacts: Path
) -> None:
    session, level, view = window.session, window.level, window.viewport
    region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    base = session.shown.vertices
    dragged(level.slider, 0.5)
    rest(window, qtbot)
    halfway = session.document.draft.level
    assert 0.4 < halfway < 0.6
    assert 0 < known.mode_count(halfway) < known.m
    assert level.percent.value() == pytest.approx(100 * halfway, abs=0.1)
    assert view.scene.ghost is not None
    picture(window, artefacts, "level halfway")
    dragged(level.slider, 1.0)
    rest(window, qtbot)
    assert (session.shown.vertices == session.document.mesh.vertices).all()
    assert view.scene.ghost is None, "nothing differs any more"
    dragged(level.feature_slider, 0.0)
    rest(window, qtbot)
    assert (session.shown.vertices == base).all()
    # Where a bump of the original stands over the base, its ghost is seen.
    with_ghost = pixels(view)
    assert view.scene.ghost is not None
    view.ghost(None)
    rest(window, qtbot)
    assert (np.abs(pixels(view) - with_ghost).max(axis=2) > 3).sum() > 500


def test_the_amount_is_dragged(window: Window, qtbot) -> None:
    session, edit = window.session, window.edit
    region(window, qtbot)
    curve(window, qtbot, sag=-0.4)
    anchors = session.document.draft.strokes[0].anchors
    full = session.shown.vertices[anchors]
    dragged(edit.amount, 0.0)
    rest(window, qtbot)
    still = session.shown.vertices[anchors]
    assert (full != still).any()
    dragged(edit.amount, 1 / 3)
    rest(window, qtbot)
    share = session.document.draft.options.amount
    assert 0.4 < share < 0.6
    way = np.linalg.norm(session.shown.vertices[anchors] - still, axis=1)
    assert way.max() == pytest.approx(share * np.linalg.norm(full - still, axis=1).max(), rel=0.1)


def test_a_level_just_above_the_base_does_not_read_as_the_base(window: Window, qtbot) -> None:
    session, percent = window.session, window.level.percent
    region(window, qtbot)
    for level, told in ((0.0004, 0.04), (0.25, 25.0), (0.99996, 99.996), (0.0, 0.0)):
        session.slide_level(level)
        rest(window, qtbot)
        assert session.document.draft.level == level, "what is shown changes nothing"
        assert percent.value() == pytest.approx(told, abs=1e-9)
    assert percent.decimals() == 1
