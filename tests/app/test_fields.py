"""Fields and choices: Enter takes a number that was typed before it applies anything."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDoubleSpinBox

from app.window import Window
from tests.app.driving import Mouse, circle, settled


def test_enter_takes_a_number_and_then_applies(window: Window, qtbot) -> None:
    session = window.session
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    qtbot.waitUntil(settled(window))
    window.toolhost.choose("smooth")
    qtbot.waitUntil(settled(window))
    field = window.strip.findChild(QDoubleSpinBox, "option amount")
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, "1")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert window.toolbox.options_of("smooth").amount == 1.0
    assert not session.document.recipe.steps
    qtbot.waitUntil(settled(window))
    qtbot.keyClick(field, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    assert session.document.recipe.steps[0].amount == 1.0


def test_the_circle_of_a_tool_goes_with_it(window: Window, qtbot) -> None:
    view = window.viewport
    qtbot.keyClick(view, Qt.Key.Key_P)
    Mouse().send(view, "move", (200, 200), Qt.KeyboardModifier.NoModifier)
    assert view.overlay._brush is not None
    qtbot.keyClick(view, Qt.Key.Key_L)
    assert view.overlay._brush is None


def test_the_target_is_a_smooth_line_from_every_side() -> None:
    from app.stage import on_picture_plane
    from engine import Stroke, source_curve
    from engine.view import look_at

    view = look_at([0, 0, 0], 200, 0, 0, (800, 600))
    x = np.linspace(-40, 40, 60)
    anchors = np.column_stack([x, 10 + np.where(np.arange(60) % 2, 1.5, -1.5), 0.02 * x**2])
    target = view.project(anchors) + np.array([0.0, 25.0])
    line = on_picture_plane(Stroke(np.arange(60), view, target), anchors)
    assert np.abs(view.project(line) - source_curve(target)).max() < 1e-6
    rough, drawn = (np.abs(np.diff(one[:, 1], 2)).max() for one in (target, view.project(line)))
    assert drawn < 0.2 * rough
    depth, zigzag = line @ (0.0, 1.0, 0.0), anchors[:, 1]
    assert np.abs(np.diff(depth, 2)).max() < 0.1 * np.abs(np.diff(zigzag, 2)).max()
    assert abs(depth.mean() - 10) < 1
