"""Inking: what is drawn over the picture without a render of the scene."""

from __future__ import annotations

from numpy.typing import ArrayLike
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.looking import Looking
from app.viewport.overlay import Backdrop, Overlay


class Inking(Looking):
    """Strokes, the brush's circle and the picture to trace."""

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self.overlay = Overlay(self)
        self.overlay.set_theme(theme)
        self.cube.raise_()

    def resizeGL(self, width: int, height: int) -> None:
        """Follow the widget's size."""
        super().resizeGL(width, height)
        self.overlay.setGeometry(self.rect())

    def _apply_eye(self) -> None:
        super()._apply_eye()
        self.overlay.follow(self.view())

    def ink(self, path: ArrayLike, role: str, closed: bool = False) -> None:
        """Show a stroke (p, 2) over the picture; nothing is rendered for it."""
        self.overlay.ink(path, role, closed)

    def clear_ink(self) -> None:
        """Take the stroke away."""
        self.overlay.clear_ink()

    def brush(self, x: float, y: float, radius: float | None) -> None:
        """Show the brush as a circle of `radius` px about a point; None takes it away."""
        self.overlay.set_brush(None if radius is None else (x, y, radius))

    def set_backdrop(
        self, image: QImage | None, opacity: float = 0.5, place: QRectF | None = None
    ) -> None:
        """Lay a picture to trace over the form; None takes it away.

        Parameters
        ----------
        opacity : how much of it shows, 0..1.
        place : where it lies, logical pixels; else in the middle, as large as fits.
        """
        if image is None or image.isNull():
            self.overlay.set_backdrop(None)
            return
        if place is None:
            size = QSizeF(image.size()).scaled(
                QSizeF(self.size()) * 0.9, Qt.AspectRatioMode.KeepAspectRatio
            )
            corner = QPointF(self.width() - size.width(), self.height() - size.height()) / 2
            place = QRectF(corner, size)
        self.overlay.set_backdrop(Backdrop(image, place, min(1.0, max(0.0, opacity))))

    def fade_backdrop(self, opacity: float) -> None:
        """Let more or less of the picture to trace show, 0..1."""
        self.overlay.fade_backdrop(opacity)
