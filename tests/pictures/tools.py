"""The edit tools beside the sketch."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from tests.app.driving import circle
from tests.pictures.first_edit import BELLY, circled
from tests.pictures.region import RIBS
from tests.pictures.studio import Stage


def tools(stage: Stage) -> None:
    """Every tool on a part that suits it; most show at once what Enter would do."""
    host = stage.window.toolhost
    view = stage.window.viewport

    def take(name: str, **options: str) -> None:
        stage.click(stage.window.rail.buttons[name])
        for option, value in options.items():
            stage.type(stage.option(option), value)
            stage.press_in(stage.option(option), Qt.Key.Key_Tab)
        assert host.active is host.toolbox.tools[name]
        stage.rest()

    def enter() -> None:
        session = stage.window.session
        steps = len(session.document.recipe.steps)
        stage.press(Qt.Key.Key_Return)
        stage.until(lambda: len(session.document.recipe.steps) > steps)
        stage.rest()

    stage.open("vase")
    stage.stroke(circled(view, BELLY))
    stage.modes(200)
    take("smooth", amount="1")
    stage.keep_canvas("tool-smooth")
    take("equaliser", medium="2", small="2.2")
    stage.keep_canvas("tool-equaliser")

    stage.open("tank")
    stage.stroke(stage.shares(RIBS, closed=True))
    stage.rest()
    take("inflate", distance="24")
    stage.keep_canvas("tool-inflate")
    enter()
    stage.press(Qt.Key.Key_Escape)
    stage.press(Qt.Key.Key_7)
    stage.rest()
    take("symmetrise")
    stage.rest()
    stage.keep_canvas("tool-symmetrise")

    stage.open("drill")
    stage.stroke(stage.shares([(0.2, 0.13), (0.55, 0.13), (0.55, 0.4), (0.19, 0.36)], closed=True))
    stage.rest()
    take("handle", radius="48")
    hold = np.array([[0.33, 0.22]]) * (view.width(), view.height())
    drag = hold + np.linspace(0, 1, 8)[:, None] * (-10.0, -40.0)
    stage.stroke(drag, release=False)
    stage.rest()
    stage.keep_canvas("tool-handle")
    stage.let_go(drag[-1])

    stage.open("plate")
    stage.stroke(circle(view, 0.05, 0.0, 0.1))
    stage.rest()
    stage.press(Qt.Key.Key_W)
    stage.press(Qt.Key.Key_F)
    take("remesh", density="0.5")
    enter()
    stage.keep_canvas("tool-remesh")
