"""Curves: drawn with a pen, dragged, several, closed, pinned."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QSettings, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF

from app.pen_pressure import KEY, PenPressure
from tests.app.driving import Pen, bow, circle
from tests.pictures.region import RIB, RIBS
from tests.pictures.studio import Stage


def pen(stage: Stage) -> None:
    """A pen draws on the tank; its target is dragged in part, then another curve follows."""
    window = stage.window
    view = window.viewport
    stage.open("tank")
    hand = Pen()
    stage.stroke(stage.shares(RIBS, closed=True), hand=hand)
    stage.rest()
    stage.click(stage.option("weights"))
    source = stage.shares(RIB)
    stage.stroke(source, release=False, hand=hand)
    stage.keep("sketch-source")
    hand.send(view, "release", source[-1], Qt.KeyboardModifier.NoModifier)
    stage.rest()
    stage.press(Qt.Key.Key_7)
    stage.rest()
    stage.stroke(stage.bulged(0, 30), hand=hand)
    stage.rest()
    stroke = window.session.document.draft.strokes[0]
    held = stroke.target[len(stroke.target) // 2]
    drag = held + np.linspace(0, 1, 8)[:, None] * (8.0, 34.0)
    stage.stroke(drag, release=False, hand=hand)
    stage.rest()
    stage.keep("sketch-drag")
    hand.send(view, "release", drag[-1], Qt.KeyboardModifier.NoModifier)
    stage.rest()
    stage.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    stage.rest()
    curve = window.session.document.draft.strokes[0].target
    begins, ends = curve[len(curve) // 6], curve[3 * len(curve) // 5]
    t = np.linspace(0, 1, 40)[:, None]
    across = np.array([[0, 1], [-1, 0]]) @ (ends - begins)
    again = begins + t * (ends - begins) - 0.07 * np.sin(np.pi * t) ** 2 * across
    stage.stroke(again, release=False, hand=hand)
    stage.rest()
    stage.keep("sketch-redraw")
    hand.send(view, "release", again[-1], Qt.KeyboardModifier.NoModifier)
    stage.rest()


def pressure(stage: Stage) -> None:
    """How hard a pen has to press is set, and tried with a pen."""
    stage.open("tank")
    stage.press(Qt.Key.Key_P)
    stage.key("tools.pen")
    dialog = next(iter(stage.window.findChildren(PenPressure)))
    stage.until(dialog.isVisible)
    dialog.slider.setValue(-70)
    hand = Pen(pressure=0.5)
    hand.send(dialog.curve, "press", (90, 90), Qt.KeyboardModifier.NoModifier)
    stage.dialog("pen-pressure")
    QSettings().remove(KEY)


def vase_from_the_front(stage: Stage) -> None:
    """Open the vase and look at it straight."""
    stage.open("vase")
    stage.press(Qt.Key.Key_1)
    stage.rest()


def several(stage: Stage) -> None:
    """The vase with a pin and two curves, drawn from two sides."""
    window = stage.window
    view = window.viewport
    vase_from_the_front(stage)
    stage.stroke(circle(view, 0.0, 0.02, 0.2))
    stage.rest()
    stage.click(window.level._head)
    stage.click(window.edit._more._head)
    stage.press(Qt.Key.Key_N)
    stage.stroke(bow(view, (0.0, 0.02), (0.001, 0.02), n=2))
    stage.rest()
    stage.press(Qt.Key.Key_S)
    for sag in (0.0, 0.5):
        stage.stroke(bow(view, (-0.11, -0.06), (-0.11, 0.1), sag=sag))
        stage.rest()
    stage.press(Qt.Key.Key_S)
    stage.stroke(bow(view, (0.11, -0.06), (0.11, 0.1)))
    stage.rest()
    stage.turn(-70, 0)
    stage.stroke(bow(view, (0.07, -0.06), (0.07, 0.1), sag=-0.5))
    stage.rest()
    stage.turn(50, 20)
    stage.rest()
    stage.keep("sketch-several")


def closed(stage: Stage) -> None:
    """A closed curve around a pocket of the plate."""
    stage.open("plate")
    stage.press(Qt.Key.Key_7)
    stage.rest()
    t = np.linspace(0, 2 * np.pi, 60)

    def ring(wide: float, high: float, height: float) -> np.ndarray:
        return stage.seen(
            np.column_stack([wide * np.cos(t), high * np.sin(t), np.full(len(t), height)])
        )

    stage.stroke(ring(105, 72, 20))
    stage.rest()
    stage.stroke(ring(42, 30, 24))
    stage.rest()
    stage.turn(0, -150)
    stage.rest()
    stage.stroke(ring(42, 30, 52))
    stage.rest()
    stage.keep("sketch-closed")


def drawing(stage: Stage, swell: float) -> QImage:
    """Return a pencil sketch of the vase as it is seen, its belly wider by `swell` of its size."""
    view = stage.window.viewport
    seen = stage.seen(stage.window.session.document.mesh.vertices)
    middle = (seen[:, 0].min() + seen[:, 0].max()) / 2
    rows = np.linspace(seen[:, 1].min() + 1, seen[:, 1].max() - 1, 60)
    wide = np.array([np.abs(seen[np.abs(seen[:, 1] - y) < 5, 0] - middle).max() for y in rows])
    wide *= 1 + swell * np.sin(np.pi * np.linspace(0, 1, len(rows))) ** 6
    image = QImage(view.width(), view.height(), QImage.Format.Format_RGB32)
    image.fill(QColor("#f6f1e4"))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor("#3c4250"), 2.0))
    for side in (-1, 1):
        points = np.column_stack([middle + side * wide, rows])
        painter.drawPolyline(QPolygonF([QPointF(*one) for one in points]))
    for row in (0, -1):
        painter.drawEllipse(QPointF(middle, rows[row]), wide[row], 4.0)
    painter.end()
    return image


def trace(stage: Stage) -> None:
    """A sketch lies over the vase to be traced."""
    window = stage.window
    view = window.viewport
    vase_from_the_front(stage)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sketch.png"
        drawing(stage, 0.28).save(str(path))
        window.picture_files.trace(path)
        stage.rest()
        assert window.trace_bar.isVisible()
    stage.stroke(circle(view, 0.06, 0.03, 0.2))
    stage.rest()
    stage.stroke(bow(view, (0.14, -0.08), (0.14, 0.14)))
    stage.rest()
    stage.stroke(bow(view, (0.16, -0.1), (0.16, 0.15), sag=-0.3), release=False)
    stage.rest()
    stage.keep("sketch-trace")
    stage.let_go(bow(view, (0.16, -0.1), (0.16, 0.15))[-1])


def outline(stage: Stage) -> None:
    """A lasso is dragged into shape before it is taken; a source snaps to the outline."""
    window = stage.window
    view = window.viewport
    vase_from_the_front(stage)
    stage.click(stage.option("through"))
    stage.click(stage.option("adjust"))
    lasso = circle(view, 0.1, 0.03, 0.17)
    stage.stroke(lasso)
    stage.rest()
    side = lasso[len(lasso) // 2]
    stage.stroke(side + np.linspace(0, 1, 8)[:, None] * (-0.08 * view.height(), 0.0))
    stage.rest()
    stage.keep_canvas("region-adjust")
    stage.press(Qt.Key.Key_Return)
    stage.until(lambda: window.session.document.draft.roi is not None)
    stage.rest()
    stage.click(stage.option("outline"))
    # Along the right edge of the form, as unsteady as a hand is.
    shown = stage.seen(window.session.shown.vertices)
    rows = view.height() * np.linspace(0.43, 0.63, 24)
    right = np.array([shown[np.abs(shown[:, 1] - y) < 4, 0].max() for y in rows])
    shaken = np.column_stack([right - 5 + 4 * np.sin(np.arange(24) * 1.7), rows])
    stage.stroke(shaken)
    stage.rest()
    stage.stroke(stage.bulged(0.06 * view.height(), 0.0))
    stage.rest()
    stage.keep_canvas("sketch-outline")
