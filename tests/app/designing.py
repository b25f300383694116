"""What a designer does in the window, by mouse and keys: a region, curves, an option, a turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from app.window import Window
from engine.arrays import F64, I64
from tests.app.driving import NONE, Mouse, bow, circle, settled

CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier
ENDS = (-0.12, 0.0), (0.12, 0.0)


def rest(window: Window, qtbot) -> None:
    """Wait until nothing is computed, apart from modes, and nothing moves."""
    qtbot.waitUntil(
        lambda: settled(window)() and not window.viewport.moving,
    )


def region(
    window: Window,
    qtbot,
    x: float = 0.0,
    y: float = 0.0,
    radius: float = 0.22,
    hand: Mouse | None = None,
) -> I64:
    """Circle a part of the form; return its vertices."""
    (hand or Mouse()).stroke(window, circle(window.viewport, x, y, radius))
    rest(window, qtbot)
    return np.asarray(window.session.document.draft.roi)


def curve(
    window: Window, qtbot, sag: float, height: float = 0.0, hand: Mouse | None = None
) -> None:
    """Draw a source across the region, and its target that sags."""
    ends = (ENDS[0][0], height), (ENDS[1][0], height)
    (hand or Mouse()).stroke(window, bow(window.viewport, *ends))
    assert window.session.document.draft.source is not None, window.session.problems.sentence
    (hand or Mouse()).stroke(window, bow(window.viewport, *ends, sag))
    rest(window, qtbot)


def modes(window: Window, qtbot) -> None:
    """Wait until all modes of the region are known."""
    known = lambda: window.session.decomposition  # noqa: E731
    qtbot.waitUntil(lambda: known() is not None and known().complete)


def draw(window: Window, qtbot, *paths: F64, hand: Mouse | None = None) -> None:
    """Draw strokes one after the other."""
    for path in paths:
        (hand or Mouse()).stroke(window, path)
    rest(window, qtbot)


def enter(window: Window, qtbot) -> None:
    """Take what is shown as a step."""
    steps = len(window.session.document.recipe.steps)
    qtbot.keyClick(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == steps + 1)
    rest(window, qtbot)


def option(window: Window, name: str) -> QWidget:
    """The control of an option of the tool in hand."""
    QApplication.processEvents()
    found = window.strip.findChildren(QWidget, f"option {name}")
    return next(one for one in found if one.isVisible())


def typed(qtbot, field: QWidget, text: str) -> None:
    """Type a number into a field in place of what it holds, and take it."""
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, text)
    qtbot.keyClick(field, Qt.Key.Key_Return)


def by_palette(window: Window, qtbot, words: str) -> None:
    """Find a command by typing, and do it."""
    qtbot.keyClick(window.viewport, Qt.Key.Key_P, CTRL | SHIFT)
    qtbot.waitUntil(window.palette_box.isVisible)
    qtbot.keyClicks(window.palette_box.line, words)
    qtbot.keyClick(window.palette_box.line, Qt.Key.Key_Return)


def turned(window: Window, qtbot, dx: float) -> None:
    """Turn the view by a drag with the middle button."""
    view = window.viewport
    at = QPoint(view.width() // 2, view.height() // 2)
    middle = Qt.MouseButton.MiddleButton
    QTest.mousePress(view, middle, NONE, at)
    for share in (0.5, 1.0):
        QTest.mouseMove(view, at + QPoint(round(share * dx), 0))
    QTest.mouseRelease(view, middle, NONE, at + QPoint(round(dx), 0))
    rest(window, qtbot)


def seen(window: Window, ids: int | I64) -> F64:
    """Where vertices of the form as it is shown are seen, (p, 2) px."""
    at = np.atleast_1d(ids)
    return np.asarray(window.viewport.view().project(window.session.shown.vertices[at]))


def colours_near(window: Window, at: Sequence[float], reach: int = 4) -> list[QColor]:
    """Colours of the pixels about a place of the form's picture."""
    window.viewport.repaint()
    image = window.viewport.grab().toImage()
    ratio = image.devicePixelRatio()
    x, y = (round(float(v) * ratio) for v in at)
    way = range(-reach, reach + 1)
    return [image.pixelColor(x + i, y + j) for i in way for j in way]
