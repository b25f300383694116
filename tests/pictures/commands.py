"""Commands and looks: palette, keys, plugins, the dark theme."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from tests.pictures.region import GRIP
from tests.pictures.studio import Stage

CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


def by_keys(stage: Stage) -> None:
    """A region painted and a curve begun without mouse or pen."""
    stage.open("tank")
    stage.press(Qt.Key.Key_K)
    hand, view = stage.window.key_hand, stage.window.viewport

    def go(*ways: tuple[float, float]) -> None:
        """Set a point at the cross, and after each way, in shares of the canvas."""
        stage.press(Qt.Key.Key_Space)
        for across, down in ways:
            for share, side, one in (
                (across, view.width(), (Qt.Key.Key_Left, Qt.Key.Key_Right)),
                (down, view.height(), (Qt.Key.Key_Up, Qt.Key.Key_Down)),
            ):
                for _ in range(round(abs(share) * side / 12)):
                    stage.press(one[int(share > 0)])
            if hand.down:
                stage.press(Qt.Key.Key_Space)

    for _ in range(round(0.26 * view.width() / 12)):
        stage.press(Qt.Key.Key_Left)
    go((0.2, -0.06), (0.26, 0.1), (-0.02, 0.12), (-0.3, -0.05))
    stage.press(Qt.Key.Key_Return)
    stage.rest()
    for key, times in ((Qt.Key.Key_Right, 4), (Qt.Key.Key_Up, 5)):
        for _ in range(times):
            stage.press(key)
    go((0.12, -0.03), (0.12, 0.0))
    for key, times in ((Qt.Key.Key_Right, 4), (Qt.Key.Key_Down, 3)):
        for _ in range(times):
            stage.press(key)
    stage.keep_canvas("keys-drawing")
    stage.press(Qt.Key.Key_Return)


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
