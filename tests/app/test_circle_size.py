"""The size of a tool's circle: by keys, and by a drag with Alt."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtWidgets import QDoubleSpinBox

from app.window import Window
from tests.app.designing import region
from tests.app.driving import NONE, Mouse, Pen, press, settled

pytestmark = pytest.mark.window
ALT = Qt.KeyboardModifier.AltModifier


def radius(window: Window) -> float:
    """The brush's radius as it is set, seen around the pointer and told above the form."""
    value = window.toolbox.options_of("brush").radius
    assert window.viewport.overlay._brush[2] == value
    field = window.strip.findChild(QDoubleSpinBox, "option radius")
    assert field.value() == value
    return float(value)


def test_keys_size_the_brush(window: Window, qtbot) -> None:
    view = window.viewport
    press(view, Qt.Key.Key_P)
    Mouse().send(view, "move", (200, 200), NONE)
    start = radius(window)
    press(view, Qt.Key.Key_Period)
    larger = radius(window)
    assert larger > start
    for _ in range(60):
        press(view, Qt.Key.Key_Comma)
    assert radius(window) == 2, "never too small to be seen"
    press(view, Qt.Key.Key_Period)
    assert radius(window) == 3, "and it grows again"
    press(view, Qt.Key.Key_L)
    assert not window.actions_table.qt["size.larger"].isEnabled(), "a lasso has no circle"


@pytest.mark.parametrize("hand", [Mouse(), Pen()], ids=["mouse", "pen"])
def test_a_drag_with_alt_sizes_the_brush_and_paints_nothing(
    window: Window, qtbot, hand: Mouse
) -> None:
    view = window.viewport
    press(view, Qt.Key.Key_P)
    middle = np.array([view.width() / 2, view.height() / 2])
    hand.send(view, "press", middle, ALT)
    hand.send(view, "move", middle + np.array([20, 5]), ALT)
    assert radius(window) == 44
    circle = view.overlay._brush
    assert QPointF(*circle[:2]) == QPointF(*middle), "it stays where the drag began"
    hand.send(view, "move", middle - np.array([10, 5]), NONE)  # Alt let go: the drag goes on
    assert radius(window) == 14
    hand.send(view, "release", middle - np.array([10, 5]), NONE)
    assert window.session.document.draft.roi is None
    hand.send(view, "press", middle, NONE)
    hand.send(view, "release", middle, NONE)
    qtbot.waitUntil(settled(window))
    assert window.session.document.draft.roi is not None, "without Alt it paints again"


def test_the_handle_is_sized_too(window: Window, qtbot) -> None:
    region(window, qtbot)
    press(window.viewport, Qt.Key.Key_H)
    before = window.toolbox.options_of("handle").radius
    press(window.viewport, Qt.Key.Key_Comma)
    assert window.toolbox.options_of("handle").radius < before
