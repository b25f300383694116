"""Curves: drawn with a pen, dragged, several, closed, pinned."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from app.draw_examples import through_points
from tests.app.driving import Pen, bow, circle
from tests.pictures.region import RIBS, flank
from tests.pictures.studio import Stage


def pen(stage: Stage) -> None:
    """A pen draws on the tank; its target is dragged in part, then another curve follows."""
    window = stage.window
    view = window.viewport
    stage.open("tank")
    hand = Pen()
    stage.stroke(flank(stage, RIBS, closed=True), hand=hand)
    stage.rest()
    stage.click(stage.option("weights"))
    source = flank(stage, [(-150, 112), (-80, 100), (0, 76), (50, 68)])
    stage.stroke(source, release=False, hand=hand)
    stage.keep("sketch-source")
    hand.send(view, "release", source[-1], Qt.KeyboardModifier.NoModifier)
    stage.rest()
    stage.press(Qt.Key.Key_7)
    stage.rest()
    line = [(-150, -62, 110), (-110, -75, 105), (-50, -105, 95), (10, -104, 78), (50, -98, 68)]
    stage.stroke(through_points(stage.seen(line)), hand=hand)
    stage.rest()
    stroke = window.session.document.draft.strokes[0]
    held = stroke.target[len(stroke.target) // 2]
    drag = held + np.linspace(0, 1, 8)[:, None] * (10.0, 46.0)
    stage.stroke(drag, release=False, hand=hand)
    stage.rest()
    stage.keep("sketch-drag")
    hand.send(view, "release", drag[-1], Qt.KeyboardModifier.NoModifier)
    stage.rest()


def several(stage: Stage) -> None:
    """The vase with a pin and two curves, drawn from two sides."""
    window = stage.window
    view = window.viewport
    stage.open("vase")
    stage.press(Qt.Key.Key_1)
    stage.rest()
    stage.stroke(circle(view, 0.0, 0.02, 0.2))
    stage.rest()
    stage.click(window.level._head)
    stage.click(window.edit._more._head)
    stage.press(Qt.Key.Key_N)
    stage.stroke(bow(view, (0.0, 0.02), (0.001, 0.02), n=2))
    stage.rest()
    stage.press(Qt.Key.Key_S)
    stage.stroke(bow(view, (-0.11, -0.06), (-0.11, 0.1)))
    stage.rest()
    stage.stroke(bow(view, (-0.11, -0.06), (-0.11, 0.1), sag=0.5))
    stage.rest()
    stage.press(Qt.Key.Key_S)
    stage.stroke(bow(view, (0.11, -0.06), (0.11, 0.1)))
    stage.rest()
    stage.turn(-70, 0)
    stage.stroke(bow(view, (0.07, -0.06), (0.07, 0.1), sag=-0.5))
    stage.rest()
    stage.turn(50, 20)
    stage.rest()
    stage.keep("sketch-several")


def closed(stage: Stage) -> None:
    """A closed curve around a pocket of the plate."""
    stage.open("plate")
    stage.press(Qt.Key.Key_7)
    stage.rest()
    t = np.linspace(0, 2 * np.pi, 60)

    def ring(wide: float, high: float, height: float) -> np.ndarray:
        return stage.seen(
            np.column_stack([wide * np.cos(t), high * np.sin(t), np.full(len(t), height)])
        )

    stage.stroke(ring(105, 72, 20))
    stage.rest()
    stage.stroke(ring(42, 30, 24))
    stage.rest()
    stage.turn(0, -150)
    stage.rest()
    stage.stroke(ring(42, 30, 52))
    stage.rest()
    stage.keep("sketch-closed")
