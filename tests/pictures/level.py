"""Levels of detail: the panel, a feature clicked, modes seen."""

from __future__ import annotations

from PySide6.QtCore import Qt

from tests.pictures.region import GRIP
from tests.pictures.studio import Stage


def level(stage: Stage) -> None:
    """The grip of the drill at several levels."""
    panel = stage.window.level
    stage.open("drill")
    stage.stroke(stage.shares(GRIP, closed=True))
    stage.key("region.smooth")
    stage.modes(200)
    stage.press(Qt.Key.Key_F)
    stage.rest()
    stage.type(panel.percent, "30")
    stage.press_in(panel.percent, Qt.Key.Key_Return)
    stage.rest()
    stage.keep("level-panel")
    stage.press(Qt.Key.Key_E)
    stage.stroke(stage.shares([(0.5, 0.5), (0.501, 0.5)])[[0, -1]])
    stage.rest()
    stage.keep("level-feature")
    stage.click(panel.modes_button)
    stage.click(panel.play)
    stage.type(panel.mode, "9")
    stage.press_in(panel.mode, Qt.Key.Key_Return)
    stage.rest()
    stage.keep("level-modes")
