"""Ink over the picture: strokes, brush, invitation, legend. The scene never renders for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QImage, QLinearGradient, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QWidget

from app.look import DARK, GUIDE, REGION, ROLE_COLOURS, Theme
from engine.arrays import F64
from engine.view import View

STROKE_WIDTH = 3.0
_HALO = 2.0
_REACH = 8
_CROSS, _CROSS_GAP = 14, 5  # px from its middle to the ends of the cross that keys move
LEGEND_WIDTH = 150
LEGEND_ABOVE = 68


@dataclass(frozen=True, eq=False)
class Ink:
    """A stroke on the screen: a path (p, 2) in logical pixels and what it is for."""

    path: F64
    role: str
    closed: bool


@dataclass(frozen=True, eq=False)
class SpaceCurve:
    """A curve in space (p, 3), mesh units, drawn over the form whatever hides it."""

    points: F64
    role: str
    closed: bool
    label: str = ""


@dataclass(frozen=True)
class Legend:
    """The scale of a colour map: stops from bottom to top, and the numbers beside them."""

    title: str
    colours: tuple[str, ...]
    low: str
    middle: str
    high: str


@dataclass(frozen=True)
class Backdrop:
    """A picture to trace: where it lies (logical pixels) and how much of it shows (0..1)."""

    image: QImage
    place: QRectF
    opacity: float


class Overlay(QWidget):
    """A transparent widget over the viewport; mouse and pen go through it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAttribute(Qt.WidgetAttribute.WA_NoSystemBackground)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.theme: Theme = DARK
        self.paints = 0
        self._ink: Ink | None = None
        self._brush: tuple[float, float, float] | None = None
        self._cross: tuple[float, float] | None = None
        self._points: tuple[tuple[float, float], ...] = ()
        self._invitation: F64 | None = None
        self._curves: dict[str, SpaceCurve] = {}
        self._legend: Legend | None = None
        self._backdrop: Backdrop | None = None
        self._view: View | None = None

    # What is shown

    def set_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.theme = theme
        self.update()

    def ink(self, path: ArrayLike, role: str, closed: bool = False) -> None:
        """Show a stroke (p, 2); when it only grew, only its new part is painted again."""
        p = np.asarray(path, dtype=np.float64).reshape(-1, 2)
        before, self._ink = self._ink, Ink(p, role, closed)
        old = before.path if before is not None else np.zeros((0, 2))
        grew = (
            before is not None
            and not closed
            and not before.closed
            and before.role == role
            and 0 < len(old) <= len(p)
            and bool((p[: len(old)] == old).all())
        )
        fresh = p[max(0, len(old) - 2) :] if grew else np.concatenate([old, p])
        self._update_around(fresh)

    def clear_ink(self) -> None:
        """Take the stroke away."""
        if self._ink is not None:
            path, self._ink = self._ink.path, None
            self._update_around(path)

    def set_brush(self, circle: tuple[float, float, float] | None) -> None:
        """Show the brush as a circle (x, y, radius), or take it away."""
        before, self._brush = self._brush, circle
        for each in (before, circle):
            if each is not None:
                x, y, r = each
                self._update_around(np.array([[x - r, y - r], [x + r, y + r]]))

    def set_cross(
        self, at: tuple[float, float] | None, points: tuple[tuple[float, float], ...] = ()
    ) -> None:
        """Show the cross that keys move, and the points they have set; None takes both away."""
        self._cross, self._points = at, points if at is not None else ()
        self.update()

    def set_invitation(self, path: ArrayLike | None) -> None:
        """Show a faint dashed lasso (p, 2) that invites to draw there; the first stroke ends it."""
        self._invitation = None if path is None else np.asarray(path, dtype=np.float64)
        self.update()

    def set_curve(self, name: str, curve: SpaceCurve | None) -> None:
        """Show a curve in space under a name, or take it away."""
        if curve is None:
            if self._curves.pop(name, None) is None:
                return
        else:
            self._curves[name] = curve
        self.update()

    def clear_curves(self) -> None:
        """Take all curves in space away."""
        self._curves.clear()
        self.update()

    def set_legend(self, legend: Legend | None) -> None:
        """Show the scale of a colour map, or take it away."""
        self._legend = legend
        self.update()

    def set_backdrop(self, backdrop: Backdrop | None) -> None:
        """Show a picture to trace, or take it away."""
        self._backdrop = backdrop
        self.update()

    @property
    def inviting(self) -> bool:
        """Whether the dashed lasso is shown."""
        return self._invitation is not None

    @property
    def legend(self) -> Legend | None:
        """The scale that is shown."""
        return self._legend

    def curve(self, name: str) -> SpaceCurve | None:
        """The curve in space of that name."""
        return self._curves.get(name)

    @property
    def backdrop(self) -> Backdrop | None:
        """The picture to trace."""
        return self._backdrop

    def fade_backdrop(self, opacity: float) -> None:
        """Let more or less of the picture to trace show."""
        if self._backdrop is not None:
            self.set_backdrop(replace(self._backdrop, opacity=min(1.0, max(0.0, opacity))))

    def follow(self, view: View) -> None:
        """Take another camera for the curves in space."""
        if self._view == view:
            return
        self._view = view
        if self._curves:
            self.update()

    # Painting

    def _update_around(self, points: F64) -> None:
        if len(points) == 0:
            return
        low, high = points.min(axis=0), points.max(axis=0)
        box = QRectF(QPointF(*low), QPointF(*high)).adjusted(-_REACH, -_REACH, _REACH, _REACH)
        self.update(box.toAlignedRect())

    def paintEvent(self, event: Any) -> None:
        """Paint what lies in the part that changed."""
        self.paints += 1
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._backdrop is not None:
            painter.setOpacity(self._backdrop.opacity)
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(self._backdrop.place, self._backdrop.image)
            painter.setOpacity(1.0)
        if self._invitation is not None:
            self._paint_invitation(painter)
        if self._view is not None:
            for curve in self._curves.values():
                self._paint_space_curve(painter, curve, self._view)
        if self._ink is not None:
            self._paint_ink(painter, self._ink, event.rect())
        if self._brush is not None:
            self._paint_brush(painter, *self._brush)
        if self._cross is not None:
            self._paint_cross(painter, *self._cross)
        if self._legend is not None:
            self._paint_legend(painter, self._legend)
        painter.end()

    def _paint_ink(self, painter: QPainter, ink: Ink, dirty: QRect) -> None:
        if len(ink.path) == 0:
            return
        colour = QColor(ROLE_COLOURS.get(ink.role, GUIDE))
        if ink.closed and len(ink.path) > 2:
            fill = QColor(colour)
            fill.setAlpha(36)
            painter.fillPath(_through(ink.path, closed=True), fill)
            self._dash(painter, ink.path[[-1, 0]], colour)
        for part in _parts_in(ink.path, dirty):
            _stroke(painter, _through(part), colour, self.theme)

    def _dash(self, painter: QPainter, ends: F64, colour: QColor) -> None:
        pen = QPen(colour, 1.5, Qt.PenStyle.DashLine, Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        painter.drawLine(QPointF(*ends[0]), QPointF(*ends[1]))

    def _paint_invitation(self, painter: QPainter) -> None:
        assert self._invitation is not None
        path = _through(self._invitation, closed=True)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        halo = QColor(self.theme.halo)
        halo.setAlpha(60)
        painter.setPen(QPen(halo, 4.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPath(path)
        violet = QColor(REGION).lighter(135)
        violet.setAlpha(215)
        pen = QPen(violet, 2.0, Qt.PenStyle.CustomDashLine, Qt.PenCapStyle.RoundCap)
        pen.setDashPattern([4.0, 4.0])
        painter.setPen(pen)
        painter.drawPath(path)

    def _paint_space_curve(self, painter: QPainter, curve: SpaceCurve, view: View) -> None:
        front = view.depth(curve.points) > 0
        if not front.all() or len(curve.points) < 2:
            return
        path = view.project(curve.points)
        colour = QColor(ROLE_COLOURS.get(curve.role, GUIDE))
        _stroke(painter, _through(path, curve.closed), colour, self.theme)
        painter.setPen(QPen(QColor(self.theme.halo), 1.0))
        painter.setBrush(colour)
        for end in () if curve.closed else (path[0], path[-1]):
            painter.drawEllipse(QPointF(*end), 4.5, 4.5)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if curve.label:
            self._paint_label(painter, path.mean(axis=0), curve.label)

    def _paint_label(self, painter: QPainter, at: F64, text: str) -> None:
        font = QFont(self.font())
        font.setPointSizeF(11)
        painter.setFont(font)
        box = QRectF(painter.fontMetrics().boundingRect(text)).adjusted(-8, -4, 8, 4)
        box.moveCenter(QPointF(float(at[0]), float(at[1]) - 20))
        ground = QColor(self.theme.panel)
        ground.setAlpha(235)
        painter.setPen(QPen(QColor(self.theme.border), 1.0))
        painter.setBrush(ground)
        painter.drawRoundedRect(box, 6, 6)
        painter.setPen(QColor(self.theme.text))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_brush(self, painter: QPainter, x: float, y: float, radius: float) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        halo = QColor(self.theme.halo)
        halo.setAlpha(130)
        painter.setPen(QPen(halo, 3.0))
        painter.drawEllipse(QPointF(x, y), radius, radius)
        painter.setPen(QPen(QColor("#f4f4f6"), 1.4))
        painter.drawEllipse(QPointF(x, y), radius, radius)

    def _paint_cross(self, painter: QPainter, x: float, y: float) -> None:
        halo = QColor(self.theme.halo)
        halo.setAlpha(150)
        for colour, width in ((halo, 4.0), (QColor("#f4f4f6"), 1.8)):
            pen = QPen(colour, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap)
            painter.setPen(pen)
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                inner, outer = QPointF(dx, dy) * _CROSS_GAP, QPointF(dx, dy) * _CROSS
                painter.drawLine(QPointF(x, y) + inner, QPointF(x, y) + outer)
            painter.drawPoint(QPointF(x, y))
        painter.setPen(QPen(halo, 1.5))
        painter.setBrush(QColor("#f4f4f6"))
        for point in self._points:
            painter.drawEllipse(QPointF(*point), 4.0, 4.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_legend(self, painter: QPainter, legend: Legend) -> None:
        font = QFont(self.font())
        font.setPointSizeF(10)
        painter.setFont(font)
        metrics = painter.fontMetrics()
        ends = metrics.horizontalAdvance(legend.low), metrics.horizontalAdvance(legend.high)
        outside = max(ends) / 2  # the numbers stand centred under the ends of the bar
        line = metrics.height()
        width = max(LEGEND_WIDTH, metrics.horizontalAdvance(legend.title)) + 2 * outside + 24
        card = QRectF(0, 0, width, 2 * line + 40)
        # Low and flat, beside the form's foot and above the row of the hint: forms are round.
        card.moveBottomRight(QPointF(self.width() - 12.0, self.height() - LEGEND_ABOVE))
        bar = QRectF(card.x() + 12 + outside, card.y() + line + 16, width - 24 - 2 * outside, 10)
        ground = QColor(self.theme.panel)
        ground.setAlpha(235)
        painter.setPen(QPen(QColor(self.theme.border), 1.0))
        painter.setBrush(ground)
        painter.drawRoundedRect(card, 8, 8)
        painter.setPen(Qt.PenStyle.NoPen)
        gradient = QLinearGradient(bar.topLeft(), bar.topRight())
        for k, colour in enumerate(legend.colours):
            gradient.setColorAt(k / (len(legend.colours) - 1), QColor(colour))
        painter.setBrush(gradient)
        painter.drawRoundedRect(bar, 3, 3)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QColor(self.theme.text))
        title = QRectF(card.x(), card.y() + 8, width, line)
        painter.drawText(title, Qt.AlignmentFlag.AlignCenter, legend.title)
        for share, text in ((0.0, legend.low), (0.5, legend.middle), (1.0, legend.high)):
            x = bar.left() + share * bar.width()
            painter.drawLine(QPointF(x, bar.bottom() + 1), QPointF(x, bar.bottom() + 4))
            place = QRectF(x - 40, bar.bottom() + 5, 80, line)
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)

    def sizeHint(self) -> QSize:
        """The overlay is as large as the viewport."""
        parent = self.parentWidget()
        return parent.size() if parent is not None else QSize(1, 1)


def _through(path: F64, closed: bool = False) -> QPainterPath:
    """Return a smooth path: quadratic pieces between the middles of the samples."""
    drawn = QPainterPath(QPointF(*path[0]))
    if len(path) == 1:
        drawn.lineTo(QPointF(path[0, 0] + 0.01, path[0, 1]))
        return drawn
    if closed:
        path = np.concatenate([path, path[:1]])
    middles = (path[1:] + path[:-1]) / 2
    drawn.lineTo(QPointF(*middles[0]))
    for point, middle in zip(path[1:-1], middles[1:], strict=True):
        drawn.quadTo(QPointF(*point), QPointF(*middle))
    drawn.lineTo(QPointF(*path[-1]))
    return drawn


def _parts_in(path: F64, dirty: QRect) -> list[F64]:
    """Return the stretches of `path` that come near the part being painted."""
    reach = 4 * _REACH
    low = np.array([dirty.left() - reach, dirty.top() - reach])
    high = np.array([dirty.right() + reach, dirty.bottom() + reach])
    if len(path) < 3:
        return [path]
    first, last = np.minimum(path[:-1], path[1:]), np.maximum(path[:-1], path[1:])
    near = ((first <= high) & (last >= low)).all(axis=1)
    # Two neighbours more, so that the smoothing of a stretch does not depend on where it is cut.
    wide = np.convolve(near, np.ones(5), mode="same") > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wide, [False]])))
    return [path[a : b + 1] for a, b in edges.reshape(-1, 2)]


def _stroke(painter: QPainter, path: QPainterPath, colour: QColor, theme: Theme) -> None:
    painter.setBrush(Qt.BrushStyle.NoBrush)
    halo = QColor(theme.halo)
    halo.setAlpha(110)
    for pen_colour, width in ((halo, STROKE_WIDTH + 2 * _HALO / 1.6), (colour, STROKE_WIDTH)):
        painter.setPen(
            QPen(
                pen_colour,
                width,
                Qt.PenStyle.SolidLine,
                Qt.PenCapStyle.RoundCap,
                Qt.PenJoinStyle.RoundJoin,
            )
        )
        painter.drawPath(path)
