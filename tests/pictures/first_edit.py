"""The first edit, stage by stage, as the README shows it."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QWidget

from tests.app.driving import bow, circle
from tests.pictures.studio import Stage

BELLY = (0.07, 0.02, 0.21)  # x, y and radius as shares of the canvas's height
UPPER, LOWER = (0.12, -0.1), (0.11, 0.15)


def circled(view: QWidget, part: tuple[float, float, float]) -> np.ndarray:
    """Return a lasso around a part, px."""
    x, y, radius = part
    return circle(view, x, y, radius)


def first_edit(stage: Stage) -> None:
    """Reshape the vase once: circle, slide, draw, draw, Enter."""
    view = stage.window.viewport
    stage.open("vase", welcome=True)
    stage.keep("1-open")
    lasso = circled(view, BELLY)
    stage.stroke(lasso[: len(lasso) * 4 // 5], release=False)
    stage.wait(0.3)
    stage.keep("2-circle")
    stage.let_go(lasso[-1])
    stage.settle()
    stage.keep("3-level")
    stage.stroke(bow(view, UPPER, LOWER))
    stage.rest()
    stage.keep("4-source")
    stage.stroke(bow(view, UPPER, LOWER, sag=-0.42))
    stage.rest()
    stage.keep("5-target")
    stage.key("edit.apply")
    stage.rest()
    stage.keep("6-applied")
