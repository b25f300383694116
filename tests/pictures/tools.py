"""The edit tools beside the sketch."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from tests.app.driving import circle
from tests.pictures.first_edit import BELLY, circled
from tests.pictures.region import RIBS, flank, shares
from tests.pictures.studio import Stage


def tools(stage: Stage) -> None:
    """Every tool on a part that suits it; most show at once what Enter would do."""
    host = stage.window.toolhost
    view = stage.window.viewport

    def take(name: str, **options: str) -> None:
        stage.click(stage.window.rail.buttons[name])
        for option, value in options.items():
            stage.type(stage.option(option), value)
            stage.press_in(stage.option(option), Qt.Key.Key_Return)
        assert host.active is host.tools[name]
        stage.rest()

    stage.open("vase")
    stage.stroke(circled(view, BELLY))
    stage.modes(200)
    take("smooth", amount="1")
    stage.keep_canvas("tool-smooth")
    take("equaliser", medium="2", small="2.2")
    stage.keep_canvas("tool-equaliser")

    stage.open("tank")
    stage.stroke(flank(stage, RIBS, closed=True))
    stage.rest()
    take("inflate", distance="18")
    stage.keep_canvas("tool-inflate")

    stage.open("drill")
    stage.stroke(shares(stage, [(0.2, 0.13), (0.55, 0.13), (0.55, 0.4), (0.19, 0.36)], closed=True))
    stage.rest()
    take("handle", radius="40")
    hold = np.array([[0.33, 0.22]]) * (view.width(), view.height())
    drag = hold + np.linspace(0, 1, 8)[:, None] * (-26.0, -70.0)
    stage.stroke(drag, release=False)
    stage.rest()
    stage.keep_canvas("tool-handle")
    stage.let_go(drag[-1])
    take("symmetrise")
    stage.keep_canvas("tool-symmetrise")

    stage.open("plate")
    stage.stroke(circle(view, 0.05, 0.0, 0.13))
    stage.rest()
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_F)
    steps = len(stage.window.session.document.recipe.steps)
    take("remesh")
    stage.press(Qt.Key.Key_Return)
    stage.until(lambda: len(stage.window.session.document.recipe.steps) > steps)
    stage.rest()
    stage.keep_canvas("tool-remesh")
