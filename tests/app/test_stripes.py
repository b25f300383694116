"""Zebra and reflection lines in the window: how many, and which way they lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app.window import Window
from tests.app.driving import LEFT, Mouse, bumpy_sphere, circle, picture, pixels, press, settled

pytestmark = pytest.mark.window


def changes(shown: np.ndarray, axis: int) -> int:
    """How often it goes from dark to light and back along the middle of a picture."""
    high, wide, _ = shown.shape
    line = shown[:, wide // 2] if axis == 0 else shown[high // 2]
    grey = line.mean(axis=1)
    middle = grey[len(grey) // 4 : 3 * len(grey) // 4] > 110
    return int(np.count_nonzero(np.diff(middle)))


def test_stripes_are_counted_and_laid_by_hand(make_window, qtbot, artefacts: Path) -> None:
    window = make_window(bumpy_sphere(bumps=0.0), size=(1180, 800))
    view, bar = window.viewport, window.stripes_bar
    press(view, Qt.Key.Key_1)
    qtbot.waitUntil(lambda: not view.moving)
    assert not bar.isVisible()
    press(view, Qt.Key.Key_Z)
    assert bar.isVisible()
    assert not bar.geometry().intersects(window.hint.geometry())
    few = changes(pixels(view), 0)
    assert few > 4 > changes(pixels(view), 1), "level stripes on a ball"
    bar.count.setFocus()
    qtbot.keyClick(bar.count, Qt.Key.Key_End)
    assert view.stripes.count == bar.count.maximum()
    many = pixels(view)
    assert changes(many, 0) > 2 * few, "more stripes, one above the other"
    bar.count.setValue(14)
    bar.way.setFocus()
    QTest.keyClick(bar.way, Qt.Key.Key_V)  # the choice goes to "Vertical"
    assert view.stripes.way == "vertical"
    upright = pixels(view)
    assert changes(upright, 1) > 4 > changes(upright, 0), "side by side now"
    picture(window, artefacts, "vertical stripes")
    press(view, Qt.Key.Key_X)
    assert bar.isVisible(), "lines are set likewise"
    assert view.stripes.way == "vertical"
    press(view, Qt.Key.Key_C)
    assert not bar.isVisible(), "a map has its scale there"


def test_the_keys_go_to_the_form_when_the_bar_goes(window: Window, qtbot) -> None:
    press(window.viewport, Qt.Key.Key_Z)
    bar = window.stripes_bar
    bar.count.setFocus()
    assert bar.count.hasFocus()
    press(bar.count, Qt.Key.Key_Z)
    assert not bar.isVisible()
    assert window.viewport.hasFocus()


def test_a_stroke_on_the_bar_does_not_draw(window: Window, qtbot) -> None:
    press(window.viewport, Qt.Key.Key_Z)
    bar = window.stripes_bar
    qtbot.mouseClick(bar, LEFT)
    assert not window.toolhost.in_gesture
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    qtbot.waitUntil(settled(window))
    assert window.session.document.draft.roi is not None
    assert bar.isVisible()
