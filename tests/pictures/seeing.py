"""Ways to look at a form that has been changed."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from tests.pictures.region import RIB, RIBS
from tests.pictures.studio import Stage

SHIFT = Qt.KeyboardModifier.ShiftModifier


def edited_tank(stage: Stage) -> None:
    """Open the tank and pull one flank out."""
    stage.open("tank")
    stage.stroke(stage.shares(RIBS, closed=True))
    stage.rest()
    stage.stroke(stage.shares(RIB))
    stage.rest()
    stage.press(Qt.Key.Key_7)
    stage.rest()
    stage.stroke(stage.bulged(0, 40))
    stage.rest()
    steps = len(stage.window.session.document.recipe.steps)
    stage.press(Qt.Key.Key_Return)
    stage.until(lambda: len(stage.window.session.document.recipe.steps) > steps)
    stage.rest()


def seeing(stage: Stage) -> None:
    """The tank with one flank pulled out, in every way to look."""
    window = stage.window
    view = window.viewport
    edited_tank(stage)
    stage.press(Qt.Key.Key_Escape)
    stage.press(Qt.Key.Key_0)
    stage.press(Qt.Key.Key_F)
    stage.rest()
    stage.keep_canvas("see-edited")
    QTest.keyPress(view, Qt.Key.Key_B)
    stage.rest()
    stage.keep_canvas("see-original")
    QTest.keyRelease(view, Qt.Key.Key_B)
    for key, name in (
        (Qt.Key.Key_D, "see-deviation"),
        (Qt.Key.Key_C, "see-curvature"),
        (Qt.Key.Key_Z, "see-zebra"),
        (Qt.Key.Key_X, "see-reflection"),
    ):
        stage.press(key)
        stage.rest()
        stage.wait(0.5)
        stage.keep_canvas(name)
    stage.press(Qt.Key.Key_X)
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_5)
    stage.click(view.cube)
    stage.rest()
    stage.keep_canvas("see-wireframe")
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_M)
    stage.stroke(stage.shares([(0.1, 0.55), (0.3, 0.45), (0.62, 0.27)]))
    stage.rest()
    stage.keep_canvas("see-measure")
