"""Small charts of the Level panel: curvature and its cutoff (Fig. 7), level and modes (Fig. 8)."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.look import REGION, TARGET, Theme
from engine import Decomposition
from engine.arrays import F64
from engine.figures import figure

BINS = 44
HEIGHT = 40
CAPTION = 16  # px below the bars for words


class Chart(QWidget):
    """Common ground: a field with a border and a line of words below."""

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setFixedHeight(HEIGHT + CAPTION)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._theme: Theme | None = None
        self.words = ("", "")

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the field, what is in it, and the words."""
        theme = self._theme
        if theme is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        field = QRectF(0.5, 0.5, self.width() - 1, HEIGHT - 1)
        painter.setPen(QPen(QColor(theme.border), 1))
        painter.setBrush(QColor(theme.field))
        painter.drawRoundedRect(field, 6, 6)
        inner = field.adjusted(8, 6, -8, -6)
        if self.isEnabled():
            self.paint(painter, inner, theme)
        painter.setPen(QColor(theme.faint))
        font = painter.font()
        font.setPointSizeF(max(font.pointSizeF() - 1, 8))
        painter.setFont(font)
        below = QRectF(0, HEIGHT, self.width(), CAPTION)
        align = Qt.AlignmentFlag
        name, value = self.words
        measure = painter.fontMetrics()
        both = measure.horizontalAdvance(name) + 8 + measure.horizontalAdvance(value)
        if both <= self.width():  # else the tooltip tells its name
            painter.drawText(below, align.AlignLeft | align.AlignVCenter, name)
        painter.drawText(below, align.AlignRight | align.AlignVCenter, value)
        painter.end()

    def share_at(self, event: QMouseEvent) -> float:
        """Return how far to the right in the field the pointer is, 0 to 1."""
        share = (event.position().x() - 8.5) / max(self.width() - 17, 1)
        return min(max(share, 0.0), 1.0)

    def paint(self, painter: QPainter, field: QRectF, theme: Theme) -> None:
        """Paint the content into `field`."""
        raise NotImplementedError


class Histogram(Chart):
    """Area over mean curvature |H| of the surface at the level; the line holds back 10 %.

    Signals
    -------
    asked(cutoff) : the person dragged the line to a curvature, 1 / mesh unit.
    """

    asked = Signal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Curvature at this level", parent)
        self.setToolTip(
            "How curved the surface is at this level: area over mean curvature.\n"
            "The line is the cutoff, with 90 % of the area on its left (Fig. 7):\n"
            "drag it to the right for more detail, to the left for less."
        )
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self._widest = 0.0
        self._bars: F64 = np.zeros(0)
        self._cutoff = 0.0
        self.cutoff: float | None = None

    def show_level(self, known: Decomposition | None, k: int, unit: str) -> None:
        """Show the surface at `k` modes; None for no region."""
        self.setEnabled(known is not None)
        if known is None:
            self._bars, self.cutoff, self.words = np.zeros(0), None, ("", "")
            self.update()
            return
        widest = self._widest = 2.2 * max(known.cutoff(known.m), 1e-300)
        weights, _ = np.histogram(
            known.curvature(k), bins=BINS, range=(0.0, widest), weights=known.areas
        )
        top = weights.max()
        self._bars = weights / top if top > 0 else weights
        self.cutoff = known.cutoff(k)
        self._cutoff = min(self.cutoff / widest, 1.0)
        self.words = ("Curvature", f"cutoff {figure(self.cutoff, 3)} / {unit}")
        self.update()

    def paint(self, painter: QPainter, field: QRectF, theme: Theme) -> None:
        """Bars below the cutoff in the region's colour, those above it faint."""
        if len(self._bars) == 0:
            return
        wide = field.width() / len(self._bars)
        painter.setPen(Qt.PenStyle.NoPen)
        beyond = QColor(theme.faint)
        beyond.setAlphaF(0.55)
        for i, share in enumerate(np.sqrt(self._bars)):
            kept = (i + 0.5) / len(self._bars) <= self._cutoff
            painter.setBrush(QColor(REGION) if kept else beyond)
            high = share * field.height()
            painter.drawRect(
                QRectF(field.left() + i * wide, field.bottom() - high, max(wide - 1, 1), high)
            )
        x = field.left() + self._cutoff * field.width()
        painter.setPen(QPen(QColor(TARGET), 2))
        painter.drawLine(QPointF(x, field.top()), QPointF(x, field.bottom()))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the cutoff to the pointer."""
        self._ask(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follow the pointer."""
        self._ask(event)

    def _ask(self, event: QMouseEvent) -> None:
        if self.cutoff is not None:
            self.asked.emit(self.share_at(event) * self._widest)


class LevelCurve(Chart):
    """Level over the number of modes; a press on it takes that number.

    Signals
    -------
    asked(k) : the person pressed at k modes.
    """

    asked = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Level over modes", parent)
        self.setToolTip("Level of detail over the number of modes (Fig. 8): press to take a number")
        self._counts: F64 = np.zeros(0)
        self._levels: F64 = np.zeros(0)
        self._at = 0
        self._most = 1

    def show_level(self, known: Decomposition | None, k: int) -> None:
        """Show the curve as far as it is known, and where `k` is."""
        self.setEnabled(known is not None)
        if known is None or known.k == 0:
            self._counts = self._levels = np.zeros(0)
            self.words = ("", "")
        else:
            self._most = known.k
            self._counts = np.unique(np.linspace(0, known.k, 96).astype(np.int64)).astype(float)
            self._levels = np.array([known.level_of(int(c)) for c in self._counts])
            self.words = ("Level over modes", f"{known.k:,}")
        self._at = k
        self.update()

    def paint(self, painter: QPainter, field: QRectF, theme: Theme) -> None:
        """The curve, and a dot at the current number of modes."""
        if len(self._counts) == 0:
            return
        x = field.left() + self._counts / self._most * field.width()
        y = field.bottom() - self._levels * field.height()
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(REGION), 2))
        painter.drawPolyline(QPolygonF([QPointF(*p) for p in zip(x, y, strict=True)]))
        at = min(self._at, self._most)
        dot = QPointF(
            field.left() + at / self._most * field.width(),
            field.bottom() - float(np.interp(at, self._counts, self._levels)) * field.height(),
        )
        painter.setPen(QPen(QColor(theme.field), 2))
        painter.setBrush(QColor(TARGET))
        painter.drawEllipse(dot, 5, 5)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the number of modes under the pointer."""
        self._ask(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follow the pointer."""
        self._ask(event)

    def _ask(self, event: QMouseEvent) -> None:
        if len(self._counts):
            self.asked.emit(round(self.share_at(event) * self._most))
