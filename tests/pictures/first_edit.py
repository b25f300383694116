"""The first edit, stage by stage, as the README shows it."""

from __future__ import annotations

from PySide6.QtCore import Qt

from tests.app.driving import Mouse, bow, circle
from tests.pictures.studio import Stage

BELLY = {"x": 0.07, "y": 0.02, "radius": 0.21}
UPPER, LOWER = (0.12, -0.1), (0.11, 0.15)


def first_edit(stage: Stage) -> None:
    """Reshape the vase once: circle, slide, draw, draw, Enter."""
    window, view = stage.window, stage.window.viewport
    mouse = Mouse()
    stage.open("vase", welcome=True)
    stage.keep("1-open")
    lasso = circle(view, **BELLY)
    mouse.stroke(window, lasso[: len(lasso) * 4 // 5], release=False)
    stage.wait(0.3)
    stage.keep("2-circle")
    mouse.send(view, "release", lasso[-1], Qt.KeyboardModifier.NoModifier)
    stage.settle()
    stage.keep("3-level")
    mouse.stroke(window, bow(view, UPPER, LOWER))
    stage.settle()
    stage.keep("4-source")
    mouse.stroke(window, bow(view, UPPER, LOWER, sag=-0.42))
    stage.settle()
    stage.keep("5-target")
    stage.key("edit.apply")
    stage.settle()
    stage.keep("6-applied")
