"""Body: where things lie in the window. Tools on the left, the form, panels on the right."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QBoxLayout,
    QFrame,
    QHBoxLayout,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

PANEL_WIDTH = 304


class Body(QWidget):
    """All of the window but its menu and its status bar.

    Parameters
    ----------
    rail : the tools, at the left edge.
    strip : the options of the tool, above the form.
    viewport : the form.
    panels : from top to bottom; the last takes the room that is left.

    Attributes
    ----------
    split : the viewport, and whatever is shown beside it.
    side : the panels.
    """

    def __init__(
        self, rail: QWidget, strip: QWidget, viewport: QWidget, panels: Sequence[QWidget]
    ) -> None:
        super().__init__()
        self.split = QSplitter(Qt.Orientation.Horizontal, self)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(viewport)
        self.side = _side(panels)
        self._middle = _tight(QVBoxLayout())
        self._middle.addWidget(strip)
        self._middle.addWidget(self.split, 1)
        row = _tight(QHBoxLayout(self))
        row.addWidget(rail)
        row.addLayout(self._middle, 1)
        row.addWidget(self.side)

    def put_beside(self, other: QWidget, below: QWidget) -> None:
        """Share the room of the form with another widget, half and half, and a bar below both."""
        self.split.addWidget(other)
        self._middle.addWidget(below)
        below.show()
        half = self.split.width() // 2
        self.split.setSizes([half, half])


def _side(panels: Sequence[QWidget]) -> QScrollArea:
    """Return the panels below each other, with rules between them."""
    inside = QWidget()
    column = _tight(QVBoxLayout(inside))
    for i, panel in enumerate(panels):
        if i > 0:
            column.addWidget(_rule())
        column.addWidget(panel, 1 if i == len(panels) - 1 else 0)
    side = QScrollArea()
    side.setWidget(inside)
    side.setWidgetResizable(True)
    side.setFrameShape(QFrame.Shape.NoFrame)
    side.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    side.setFixedWidth(PANEL_WIDTH)
    return side


def _tight(layout: QBoxLayout) -> QBoxLayout:
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    return layout


def _rule() -> QFrame:
    rule = QFrame()
    rule.setFrameShape(QFrame.Shape.HLine)
    rule.setFrameShadow(QFrame.Shadow.Plain)
    rule.setFixedHeight(1)
    rule.setStyleSheet("color: palette(mid);")
    return rule
