"""The view cube: which way one looks, and a click to look along an axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt, Signal
from PySide6.QtGui import QBrush, QColor, QFont, QPainter, QPen, QPolygonF, QTransform
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.camera import Eye
from engine.arrays import F64

SIZE = 92
_REACH = 25.0
# Outward, to the right and down of the label, with z up: right x down points into the cube.
_FACES: dict[str, tuple[tuple[int, int, int], tuple[int, int, int], tuple[int, int, int]]] = {
    "front": ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    "back": ((0, 1, 0), (-1, 0, 0), (0, 0, -1)),
    "right": ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "left": ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "top": ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    "bottom": ((0, 0, -1), (1, 0, 0), (0, 1, 0)),
}


def outward(side: str, up: int) -> F64:
    """Return the unit direction (3,) that a face of the cube looks to, axis 1 or 2 upright."""
    x, y, z = _FACES[side][0]
    return np.array([x, y, z] if up == 2 else [x, z, -y], dtype=np.float64)


class ViewCube(QWidget):
    """A small cube that turns with the form.

    Signals
    -------
    chosen : name of the view whose face was clicked.
    turned : the pointer dragged the cube by (dx, dy) pixels.
    """

    chosen = Signal(str)
    turned = Signal(float, float)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_NoSystemBackground)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setMouseTracking(True)
        self.setFixedSize(SIZE, SIZE)
        self.setToolTip("Click a face to look straight at it, drag to turn")
        self.setAccessibleName("View cube")
        self.theme: Theme = DARK
        self._axes: F64 = np.eye(3)
        self._up = 2
        self._hovered = ""
        self._pressed: QPointF | None = None
        self._dragged = False

    def follow(self, eye: Eye) -> None:
        """Turn as `eye` looks."""
        if not np.array_equal(self._axes, eye.axes) or self._up != eye.up:
            self._axes, self._up = eye.axes, eye.up
            self.update()

    def set_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.theme = theme
        self.update()

    def _corners(self, name: str) -> F64 | None:
        """Return the corners (4, 2) of a face, from its label's top left on; None if hidden."""
        out, right, down = (self._turned(v) for v in _FACES[name])
        if out[2] <= 0.02:
            return None
        corners = [out - right - down, out + right - down, out + right + down, out - right + down]
        place = np.array(corners)[:, :2] * (_REACH, -_REACH)
        return np.asarray(place + SIZE / 2)

    def _turned(self, v: tuple[int, int, int]) -> F64:
        x, y, z = v
        placed = (x, z, -y) if self._up == 1 else (x, y, z)
        return np.asarray(self._axes @ np.array(placed, dtype=np.float64))

    def face_at(self, at: QPointF) -> str:
        """Return the name of the face under a point, or ""."""
        for name in _FACES:
            corners = self._corners(name)
            if corners is not None and _polygon(corners).containsPoint(at, Qt.FillRule.WindingFill):
                return name
        return ""

    def paintEvent(self, _event: Any) -> None:
        """Draw the faces that are turned to the eye."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for name in _FACES:
            corners = self._corners(name)
            if corners is not None:
                self._paint_face(painter, name, corners)
        painter.end()

    def _paint_face(self, painter: QPainter, name: str, corners: F64) -> None:
        toward = self._turned(_FACES[name][0])
        hovered = name == self._hovered
        ground = QColor(self.theme.accent if hovered else self.theme.panel)
        ground = ground.lighter(round(100 + 22 * max(0.0, float(toward[1]))))
        ground.setAlpha(238)
        painter.setPen(QPen(QColor(self.theme.border), 1.2))
        painter.setBrush(QBrush(ground))
        polygon = _polygon(corners)
        painter.drawPolygon(polygon)
        square = _polygon(np.array([[0.0, 0.0], [64.0, 0.0], [64.0, 64.0], [0.0, 64.0]]))
        onto = QTransform()
        if not QTransform.quadToQuad(square, polygon, onto):
            return
        painter.save()
        painter.setTransform(onto, combine=True)
        font = QFont(self.font())
        font.setPixelSize(15)
        font.setWeight(QFont.Weight.Medium)
        painter.setFont(font)
        colour = QColor(self.theme.accent_text if hovered else self.theme.text)
        colour.setAlphaF(min(1.0, 0.25 + 0.9 * float(toward[2])))
        painter.setPen(colour)
        painter.drawText(0, 0, 64, 64, Qt.AlignmentFlag.AlignCenter, name.capitalize())
        painter.restore()

    def mousePressEvent(self, event: Any) -> None:
        """Take hold of the cube."""
        self._pressed, self._dragged = event.position(), False
        event.accept()

    def mouseMoveEvent(self, event: Any) -> None:
        """Turn the form, or show which face a click would take."""
        if self._pressed is not None:
            moved = event.position() - self._pressed
            if self._dragged or moved.manhattanLength() > 4:
                self._dragged, self._pressed = True, event.position()
                self.turned.emit(moved.x(), moved.y())
        else:
            self._hover(self.face_at(event.position()))
        event.accept()

    def mouseReleaseEvent(self, event: Any) -> None:
        """Look straight at the face that was clicked."""
        name = self.face_at(event.position())
        if self._pressed is not None and not self._dragged and name:
            self.chosen.emit(name)
        self._pressed = None
        event.accept()

    def leaveEvent(self, _event: Any) -> None:
        """Forget the face under the pointer."""
        self._hover("")

    def _hover(self, name: str) -> None:
        if name != self._hovered:
            self._hovered = name
            self.update()

    def sizeHint(self) -> QSize:
        """A fixed small square."""
        return QSize(SIZE, SIZE)


def _polygon(corners: F64) -> QPolygonF:
    return QPolygonF([QPointF(x, y) for x, y in corners])
