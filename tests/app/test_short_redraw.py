"""A short stroke beside the curve: it becomes the whole curve, and the person is told."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt

from app.window import Window
from tests.app.designing import draw, region, rest
from tests.app.driving import bow, press

pytestmark = pytest.mark.window
LEFT, RIGHT = (-0.12, 0.0), (0.12, 0.0)
TOLD = "That short stroke is the whole curve now"


def test_a_stub_beside_the_curve_is_told_and_undone(window: Window, qtbot) -> None:
    region(window, qtbot, radius=0.3)
    view = window.viewport
    draw(window, qtbot, bow(view, LEFT, RIGHT), bow(view, LEFT, RIGHT, 0.15))
    (before,) = window.session.document.draft.strokes
    assert TOLD not in window.hint.text, "a first target may be as short as it likes"
    draw(window, qtbot, bow(view, (-0.02, -0.2), (0.04, -0.2)))
    assert window.hint.text.startswith(TOLD)
    press(view, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    rest(window, qtbot)
    assert window.session.document.draft.strokes == (before,)
    draw(window, qtbot, bow(view, (-0.11, -0.2), (0.1, -0.2)))
    assert window.session.document.draft.strokes != (before,)
    assert TOLD not in window.hint.text, "one nearly as long was meant so"
