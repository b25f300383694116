"""Regions: brush, lasso through the form, commands, names, both sides at once."""

from __future__ import annotations

from PySide6.QtCore import Qt

from tests.pictures.studio import Stage

CTRL = Qt.KeyboardModifier.ControlModifier
GRIP = [(0.345, 0.44), (0.415, 0.44), (0.415, 0.66), (0.31, 0.66)]  # shares of the canvas
RIBS = [
    (0.21, 0.43), (0.4, 0.475), (0.58, 0.55), (0.7, 0.575), (0.71, 0.72), (0.58, 0.72),
    (0.4, 0.62), (0.23, 0.53),
]  # fmt: skip
RIB = [(0.25, 0.475), (0.4, 0.54), (0.53, 0.6), (0.67, 0.63)]


def region(stage: Stage) -> None:
    """The grip of the drill is painted, circled through, changed and named."""
    window = stage.window
    stage.open("drill")
    stage.press(Qt.Key.Key_P)
    stage.stroke(stage.shares([(0.34, 0.48), (0.37, 0.53), (0.34, 0.58), (0.37, 0.62)]))
    stage.stroke(stage.shares([(0.335, 0.62), (0.34, 0.55), (0.345, 0.49)]))
    stage.rest()
    stage.stroke(stage.shares([(0.33, 0.64), (0.375, 0.64), (0.36, 0.57)]), release=False)
    stage.keep("region-brush")
    stage.let_go(stage.shares([(0.36, 0.57), (0.361, 0.57)])[0])

    stage.press(Qt.Key.Key_L)
    stage.click(stage.option("through"))
    stage.stroke(stage.shares(GRIP, closed=True))
    stage.rest()
    stage.press(Qt.Key.Key_Equal, CTRL)
    stage.rest()
    stage.key("region.smooth")
    stage.rest()
    stage.key("region.keep")
    stage.type(window.ask.line, "Grip")
    stage.keep_canvas("region-name")
    stage.press_in(window.ask.line, Qt.Key.Key_Return)
    stage.rest()
    stage.turn(-60, 20)
    stage.menu("Region", "region")
    stage.keep("region-menu")
    stage.close_menus()


def pull_flank(stage: Stage, by: float) -> None:
    """Draw a rib of the tank, and its target from above, `by` px farther out."""
    stage.stroke(stage.shares(RIBS, closed=True))
    stage.rest()
    stage.stroke(stage.shares(RIB))
    stage.rest()
    stage.press(Qt.Key.Key_7)
    stage.rest()
    stage.stroke(stage.bulged(0, by))
    stage.rest()


def symmetric(stage: Stage) -> None:
    """One flank of the tank is drawn on; the other follows."""
    stage.open("tank")
    stage.press(Qt.Key.Key_Y)
    stage.until(lambda: stage.window.session.document.draft.options.mirror)
    stage.rest()
    stage.keep_canvas("region-plane")
    pull_flank(stage, 40)
    stage.turn(0, -70)
    stage.rest()
    stage.keep("region-symmetric")
