"""Regions: brush, lasso through the form, commands, names, both sides at once."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from app.draw_examples import through_points
from tests.pictures.studio import Stage

CTRL = Qt.KeyboardModifier.ControlModifier
GRIP = [(0.345, 0.44), (0.415, 0.44), (0.415, 0.66), (0.31, 0.66)]  # shares of the canvas
RIBS = [
    (-188, 118), (-150, 138), (-60, 124), (20, 96), (70, 92), (70, 40), (0, 40), (-100, 66),
    (-190, 92),
]  # fmt: skip  # x and z on the tank's flank, mm


def shares(stage: Stage, points: list[tuple[float, float]], closed: bool = False) -> np.ndarray:
    """Return a smooth path through points given as shares of the canvas, px."""
    view = stage.window.viewport
    return through_points(np.array(points) * (view.width(), view.height()), closed)


def flank(stage: Stage, points: list[tuple[float, float]], closed: bool = False) -> np.ndarray:
    """Return a smooth path through points (x, z) of the tank's near flank, px."""
    x, z = np.array(points, float).T
    return through_points(stage.seen(np.column_stack([x, np.full(len(x), -80.0), z])), closed)


def region(stage: Stage) -> None:
    """The grip of the drill is painted, circled through, changed and named."""
    window = stage.window
    stage.open("drill")
    stage.press(Qt.Key.Key_P)
    stage.stroke(shares(stage, [(0.34, 0.48), (0.37, 0.53), (0.34, 0.58), (0.37, 0.62)]))
    stage.stroke(shares(stage, [(0.335, 0.62), (0.34, 0.55), (0.345, 0.49)]))
    stage.rest()
    stage.stroke(shares(stage, [(0.33, 0.64), (0.375, 0.64), (0.36, 0.57)]), release=False)
    stage.keep("region-brush")
    stage.let_go(shares(stage, [(0.36, 0.57), (0.361, 0.57)])[0])

    stage.press(Qt.Key.Key_L)
    stage.click(stage.option("through"))
    stage.stroke(shares(stage, GRIP, closed=True))
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
    stage.turn(-150, 40)
    stage.menu("Region", "region")
    stage.keep("region-menu")
    stage.close_menus()


def symmetric(stage: Stage) -> None:
    """One flank of the tank is drawn on; the other follows."""
    stage.open("tank")
    stage.press(Qt.Key.Key_Y)
    stage.until(lambda: stage.window.session.document.draft.options.mirror)
    stage.rest()
    stage.stroke(flank(stage, RIBS, closed=True))
    stage.rest()
    stage.stroke(flank(stage, [(-150, 112), (-80, 100), (0, 76), (50, 68)]))
    stage.rest()
    stage.press(Qt.Key.Key_7)
    stage.rest()
    line = [(-150, -62, 110), (-110, -95, 105), (-50, -135, 95), (10, -130, 78), (50, -104, 68)]
    stage.stroke(through_points(stage.seen(line)))
    stage.rest()
    stage.turn(60, -190)
    stage.rest()
    stage.keep("region-symmetric")
