"""Keys mean the form again as soon as the hand is back on it."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from app.window import Window
from tests.app.designing import draw, option, region
from tests.app.driving import LEFT, Mouse, Pen, bow

pytestmark = pytest.mark.window


@pytest.mark.parametrize("hand", [Mouse(), Pen()], ids=["mouse", "pen"])
def test_after_an_option_the_first_stroke_takes_the_keys(
    window: Window, qtbot, hand: Mouse
) -> None:
    region(window, qtbot)
    qtbot.mouseClick(option(window, "weights"), LEFT)
    option(window, "weights").setFocus()
    draw(window, qtbot, bow(window.viewport, (-0.12, 0.0), (0.12, 0.0)), hand=hand)
    assert window.toolhost.active.id == "target", "the options of the source are gone"
    assert QApplication.focusWidget() is window.viewport


def test_a_tool_taken_by_its_key_leaves_no_control_with_the_keys(window: Window, qtbot) -> None:
    region(window, qtbot)
    box = option(window, "weights")
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_L)
    assert window.toolhost.active.id == "lasso"
    assert QApplication.focusWidget() is window.viewport
