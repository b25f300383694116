"""A window of 800 x 600 stays one, whatever is in hand and whatever is compared."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QDoubleSpinBox

from app.window import Window
from tests.app.designing import enter, region, rest
from tests.app.driving import LEFT, picture

pytestmark = pytest.mark.window


def inside(window: Window, control) -> bool:
    """Whether all of a control is seen on the shelf."""
    shelf = window.body.shelf
    left = control.mapTo(shelf, QPoint(0, 0)).x()
    return left >= 0 and left + control.width() <= shelf.width()


def test_no_tool_makes_the_window_wider(make_window, sphere, qtbot, artefacts: Path) -> None:
    window = make_window(sphere, size=(800, 600))
    region(window, qtbot)
    for name in window.toolbox.tools:
        window.toolhost.choose(name)
        rest(window, qtbot)
        assert window.width() == 800, name
    window.toolhost.choose("equaliser")
    rest(window, qtbot)
    shelf = window.body.shelf
    last = window.strip.findChild(QDoubleSpinBox, "option fine")
    qtbot.waitUntil(shelf.more.isVisible)
    assert not inside(window, last)
    for _ in range(4):
        if inside(window, last):
            break
        qtbot.mouseClick(shelf.more, LEFT)
    assert inside(window, last), "the button goes on to what had no room"
    picture(window, artefacts, "narrow equaliser")
    window.toolhost.choose("pin")
    rest(window, qtbot)
    qtbot.waitUntil(lambda: not shelf.more.isVisible())


def test_a_control_that_the_keys_go_to_is_seen(make_window, sphere, qtbot) -> None:
    window = make_window(sphere, size=(800, 600))
    region(window, qtbot)
    window.toolhost.choose("equaliser")
    rest(window, qtbot)
    first = window.strip.findChild(QDoubleSpinBox, "option large")
    last = window.strip.findChild(QDoubleSpinBox, "option fine")
    qtbot.waitUntil(
        lambda: inside(window, first) and first.isVisible() and not inside(window, last)
    )
    first.setFocus()
    for _ in range(3):
        qtbot.keyClick(window.focusWidget(), Qt.Key.Key_Tab)
    assert last.hasFocus()
    qtbot.waitUntil(lambda: inside(window, last))


def test_comparing_leaves_the_window_as_wide_as_it_is(
    make_window, sphere, qtbot, artefacts: Path
) -> None:
    window = make_window(sphere, size=(800, 600))
    region(window, qtbot)
    window.toolhost.choose("inflate")
    rest(window, qtbot)
    enter(window, qtbot)
    window.compare_with(min(window.session.history.moments))
    rest(window, qtbot)
    compare = window.compare
    qtbot.waitUntil(lambda: compare.viewport.isVisible() and compare.morph.shelf.isVisible())
    picture(window, artefacts, "narrow compare")
    assert window.width() == 800
    assert not compare.viewport.cube.isVisible(), "one cube turns both"
    assert compare.header.geometry().right() <= compare.viewport.width(), "its buttons are seen"
    window.resize(1300, 800)
    qtbot.waitUntil(compare.viewport.cube.isVisible)
