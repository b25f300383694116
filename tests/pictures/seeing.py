"""Ways to look at a form that has been changed."""

from __future__ import annotations

from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest

from tests.pictures.region import pull_flank
from tests.pictures.studio import Stage

SHIFT = Qt.KeyboardModifier.ShiftModifier


def edited_tank(stage: Stage) -> None:
    """Open the tank and pull one flank out."""
    stage.open("tank")
    pull_flank(stage, 30)
    steps = len(stage.window.session.document.recipe.steps)
    stage.press(Qt.Key.Key_Return)
    stage.until(lambda: len(stage.window.session.document.recipe.steps) > steps)
    stage.rest()


def seeing(stage: Stage) -> None:
    """The tank with one flank pulled out, in every way to look."""
    window = stage.window
    view = window.viewport
    edited_tank(stage)
    stage.press(Qt.Key.Key_0)
    stage.rest()
    view.frame(animate=False)
    stage.press(Qt.Key.Key_Z)
    stage.rest()
    stage.keep_canvas("see-zebra")
    stage.press(Qt.Key.Key_B, SHIFT)
    stage.rest()
    stage.keep_canvas("see-base")
    stage.press(Qt.Key.Key_B, SHIFT)
    stage.press(Qt.Key.Key_Z)
    stage.press(Qt.Key.Key_Escape)
    stage.rest()
    stage.keep_canvas("see-edited")
    QTest.keyPress(view, Qt.Key.Key_B)
    stage.rest()
    stage.keep_canvas("see-original")
    QTest.keyRelease(view, Qt.Key.Key_B)
    for key, name in (
        (Qt.Key.Key_D, "see-deviation"),
        (Qt.Key.Key_C, "see-curvature"),
        (Qt.Key.Key_X, "see-reflection"),
    ):
        stage.press(key)
        stage.rest()
        stage.wait(0.5)
        stage.keep_canvas(name)
    stage.press(Qt.Key.Key_X)
    stage.press(Qt.Key.Key_A)
    stage.rest()
    stage.keep_canvas("see-occlusion")
    window.hint.set_notice("")
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_5)
    stage.click(view.cube)
    stage.rest()
    before = view.eye
    view.zoom_at(0.85 * view.width(), 0.5 * view.height(), 4.0)
    stage.rest()
    stage.keep_canvas("see-wireframe")
    view.look(before, animate=False)
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_M)
    stage.stroke(stage.shares([(0.1, 0.55), (0.3, 0.45), (0.62, 0.27)]))
    stage.rest()
    stage.keep_canvas("see-measure")


def kept(stage: Stage) -> None:
    """Views that are kept, the turntable, a picture to be saved."""
    window = stage.window
    stage.open("drill")
    for key, name in ((Qt.Key.Key_1, "Catalogue"), (Qt.Key.Key_3, "Grip from behind")):
        stage.press(key)
        stage.rest()
        stage.key("view.keep")
        stage.type(window.ask.line, name)
        stage.press_in(window.ask.line, Qt.Key.Key_Return)
    stage.press(Qt.Key.Key_0)
    stage.rest()
    stage.until(lambda: not window.viewport.moving)
    window.viewport.standard_view("three-quarter", animate=False)
    window.viewport.turn_by(-1.0, 0.0)  # from where it comes round while the menu opens
    stage.key("view.turntable")
    stage.menu("View", "kept views")
    stage.keep("see-menu")
    stage.close_menus()
    window.viewport.set_turntable(False)
    stage.press(Qt.Key.Key_0)
    stage.rest()
    # The dialog waits for its end: it is kept and closed from within.
    QTimer.singleShot(0, lambda: stage.dialog("see-picture"))
    stage.key("view.picture")
    stage.rest()
