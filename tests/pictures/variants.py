"""The tree of steps: branches, names, two side by side."""

from __future__ import annotations

from PySide6.QtCore import Qt

from tests.app.driving import bow
from tests.pictures.first_edit import BELLY, LOWER, UPPER, circled
from tests.pictures.studio import Stage


def edit(stage: Stage, sag: float) -> int:
    """Reshape the belly of the vase and return the moment of the step."""
    view, session = stage.window.viewport, stage.window.session
    stage.stroke(circled(view, BELLY))
    stage.rest()
    stage.stroke(bow(view, UPPER, LOWER))
    stage.rest()
    stage.stroke(bow(view, UPPER, LOWER, sag=sag))
    stage.rest()
    steps = len(session.document.recipe.steps)
    stage.press(Qt.Key.Key_Return)
    stage.until(lambda: len(session.document.recipe.steps) > steps)
    stage.rest()
    return int(session.history.current_id)


def variants(stage: Stage) -> None:
    """Three variants of the vase, two of them named."""
    window, session = stage.window, stage.window.session
    stage.open("vase")
    stage.click(window.level._head)
    for sag, name in ((-0.42, "Full"), (0.12, "Slim")):
        session.go(0)
        stage.rest()
        edit(stage, sag)
        stage.click(window.steps.name)
        editor = window.steps.tree.viewport().focusWidget()
        stage.type(editor, name)
        stage.press_in(editor, Qt.Key.Key_Return)
        stage.rest()
    stage.keep("variants-tree")
    for moment, name in (("Slim", "variants-flip"), ("Full", "variants-flipped")):
        stage.rest()
        assert session.moment.name == moment
        stage.keep_canvas(name)
        if moment == "Slim":
            session.go(next(k for k, one in session.history.moments.items() if one.name == "Full"))
            session.go(next(k for k, one in session.history.moments.items() if one.name == "Slim"))
        stage.press(Qt.Key.Key_V)
    other = next(one.id for one in session.history.moments.values() if one.name == "Full")
    window.steps.compare_asked.emit(other)
    stage.wait(1.0)
    stage.rest()
    stage.turn(40, 10)
    stage.rest()
    stage.keep("variants-compare")
    slider = window.compare.morph.form
    slider.setFocus()
    for _ in range(6):
        stage.press_in(slider, Qt.Key.Key_PageUp)
    stage.rest()
    stage.wait(0.5)
    stage.keep("variants-morph")
