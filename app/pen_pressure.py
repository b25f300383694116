"""Pen pressure: how hard one has to press, as a curve that is bent between soft and firm."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSettings, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF, QTabletEvent
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSlider,
    QVBoxLayout,
    QWidget,
)

from app.look import REGION, TARGET, Theme
from app.panels.panel import GRID

KEY = "pen/firmness"
MOST = 100  # of the slider, to either side
SIDE = 200  # px of the chart


def counted(pressure: float, firmness: float) -> float:
    """Return what a pressure counts, 0..1: pressure to the power 2 ** (2 firmness).

    Parameters
    ----------
    pressure : as the tablet tells it, 0..1.
    firmness : -1 (soft: a light touch counts much) to 1 (firm); at 0 it counts as it is.
    """
    return float(min(max(pressure, 0.0), 1.0) ** (2.0 ** (2.0 * firmness)))


def remembered() -> float:
    """Return the firmness that the person has chosen, -1..1."""
    value = QSettings().value(KEY, 0.0)
    try:
        firmness = float(str(value))
    except ValueError:
        return 0.0
    return min(max(firmness, -1.0), 1.0) if math.isfinite(firmness) else 0.0


class PressureCurve(QWidget):
    """What every pressure counts; a pen that presses on it sees where it is.

    Attributes
    ----------
    tried : the pressure of the pen on it, and what that counts, or None.
    """

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setMinimumSize(SIDE, SIDE)
        self.setAccessibleName("What a pressure counts")
        self.firmness = 0.0
        self.tried: tuple[float, float] | None = None
        self._theme: Theme | None = None

    def show_firmness(self, firmness: float, theme: Theme) -> None:
        """Draw the curve of a firmness."""
        self.firmness, self._theme = firmness, theme
        if self.tried is not None:
            self.tried = self.tried[0], counted(self.tried[0], firmness)
        self.update()

    def tabletEvent(self, event: QTabletEvent) -> None:
        """Show what the pen presses."""
        event.accept()
        if event.type() == QEvent.Type.TabletRelease:
            return  # the last dot stays to be looked at
        if event.pressure() > 0:
            pressure = float(event.pressure())
            self.tried = pressure, counted(pressure, self.firmness)
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the field, the straight line, the curve, and the pen's dot."""
        theme = self._theme
        if theme is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        line = painter.fontMetrics().height()
        field = QRectF(0.5, 0.5, self.width() - 1, self.height() - line - GRID)
        painter.setPen(QPen(QColor(theme.border), 1))
        painter.setBrush(QColor(theme.field))
        painter.drawRoundedRect(field, 6, 6)
        inner = field.adjusted(12, 12, -12, -12)
        painter.setPen(QPen(QColor(theme.border), 1))
        for share in (0.25, 0.5, 0.75):
            x = inner.left() + share * inner.width()
            y = inner.top() + share * inner.height()
            painter.drawLine(QPointF(x, inner.top()), QPointF(x, inner.bottom()))
            painter.drawLine(QPointF(inner.left(), y), QPointF(inner.right(), y))
        painter.setPen(QPen(QColor(theme.faint), 1, Qt.PenStyle.DashLine))
        painter.drawLine(inner.bottomLeft(), inner.topRight())
        pressures = np.linspace(0, 1, 65) ** 3  # a soft curve is steep where it begins
        places = [_at(inner, p, counted(p, self.firmness)) for p in pressures.tolist()]
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(REGION), 2.5))
        painter.drawPolyline(QPolygonF(places))
        if self.tried is not None:
            self._paint_pen(painter, inner, theme, *self.tried)
        painter.setPen(QColor(theme.faint))
        below = QRectF(0, self.height() - line, self.width(), line)
        align = Qt.AlignmentFlag
        painter.drawText(below, align.AlignLeft, "lightly")
        painter.drawText(below, align.AlignRight, "hard")
        words = (
            ""
            if self.tried is None
            else " % counts ".join(f"{100 * one:.0f}" for one in self.tried) + " %"
        )
        painter.setPen(QColor(theme.text))
        painter.drawText(below, align.AlignHCenter, words)
        painter.end()

    def _paint_pen(
        self, painter: QPainter, inner: QRectF, theme: Theme, pressure: float, counts: float
    ) -> None:
        dot = _at(inner, pressure, counts)
        painter.setPen(QPen(QColor(TARGET), 1))
        painter.drawLine(QPointF(dot.x(), inner.bottom()), dot)
        painter.drawLine(QPointF(inner.left(), dot.y()), dot)
        painter.setPen(QPen(QColor(theme.field), 2))
        painter.setBrush(QColor(TARGET))
        painter.drawEllipse(dot, 6, 6)

    def sizeHint(self) -> QSize:
        """A square."""
        return QSize(SIDE, SIDE)


class PenPressure(QDialog):
    """The curve, and a slider that bends it; what is set counts at once and is remembered.

    Signals
    -------
    chosen(firmness) : the curve is another.
    """

    chosen = Signal(float)

    def __init__(self, theme: Theme, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Pen pressure")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._theme = theme
        words = QLabel("How hard you press, and what it counts.\nTry it here with the pen.", self)
        self.curve = PressureCurve(self)
        self.slider = QSlider(Qt.Orientation.Horizontal, self)
        self.slider.setRange(-MOST, MOST)
        self.slider.setSingleStep(5)
        self.slider.setPageStep(25)
        self.slider.setMinimumHeight(32)
        self.slider.setAccessibleName("How firmly the pen has to press")
        self.slider.setToolTip("Soft: a light touch counts much. Firm: only a strong one does")
        self.slider.valueChanged.connect(self._set)
        row = QHBoxLayout()
        row.setSpacing(GRID)
        row.addWidget(QLabel("Soft", self))
        row.addWidget(self.slider, 1)
        row.addWidget(QLabel("Firm", self))
        self.linear = QPushButton("Linear", self)
        self.linear.setToolTip("As the tablet tells it")
        self.linear.setAutoDefault(False)
        self.linear.clicked.connect(lambda: self.slider.setValue(0))
        close = QPushButton("Close", self)
        close.clicked.connect(self.accept)
        buttons = QHBoxLayout()
        buttons.addWidget(self.linear)
        buttons.addStretch(1)
        buttons.addWidget(close)
        column = QVBoxLayout(self)
        column.setContentsMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
        column.setSpacing(GRID)
        column.addWidget(words)
        column.addWidget(self.curve, 1)
        column.addLayout(row)
        column.addLayout(buttons)
        with QSignalBlocker(self.slider):
            self.slider.setValue(round(MOST * remembered()))
        self.dress(theme)

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self.curve.show_firmness(self.slider.value() / MOST, theme)

    def _set(self, value: int) -> None:
        firmness = value / MOST
        QSettings().setValue(KEY, firmness)
        self.dress(self._theme)
        self.chosen.emit(firmness)


def _at(field: QRectF, across: float, up: float) -> QPointF:
    """Return the place of two shares in a field."""
    return QPointF(field.left() + across * field.width(), field.bottom() - up * field.height())
