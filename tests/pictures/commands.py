"""Commands and looks: palette, keys, plugins, the dark theme."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from tests.pictures.region import GRIP
from tests.pictures.studio import Stage

CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


def commands(stage: Stage) -> None:
    """The drill, and what lies over it."""
    window = stage.window
    stage.open("drill")
    stage.stroke(stage.shares(GRIP, closed=True))
    stage.rest()
    stage.press(Qt.Key.Key_P, CTRL | SHIFT)
    stage.until(window.palette_box.isVisible)
    QTest.keyClicks(window.palette_box.line, "view")
    stage.wait(0.3)
    stage.keep("keys-palette")
    window.palette_box.close()
    stage.press(Qt.Key.Key_F1)
    stage.dialog("keys-sheet")
    stage.key("help.plugins")
    stage.dialog("keys-plugins")
    other = "light" if window.appearance.theme.name == "dark" else "dark"
    stage.key(f"view.theme.{other}")
    stage.rest()
    stage.keep("looks-dark")
