"""Body: where things lie in the window. Tools on the left, the form, panels on the right."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QFrame,
    QHBoxLayout,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from app.panels.panel import Panel
from app.panels.shelf import Shelf

PANEL_WIDTH = 304
LOW = 740  # px below which the panels have too little height


class Body(QWidget):
    """All of the window but its menu and its status bar.

    Parameters
    ----------
    rail : the tools, at the left edge.
    strip : the options of the tool, above the form.
    viewport : the form.
    below : a bar below the form, for as long as it is shown.
    panels : from top to bottom; the last takes the room that is left.

    Attributes
    ----------
    split : the viewport, and whatever is shown beside it.
    shelf : what the options of the tool are slid in where they have no room.
    side : the panels.
    """

    def __init__(
        self,
        rail: QWidget,
        strip: QWidget,
        viewport: QWidget,
        below: QWidget,
        panels: Sequence[Panel],
    ) -> None:
        super().__init__()
        self.split = QSplitter(Qt.Orientation.Horizontal, self)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(viewport)
        self.side = Side(panels)
        self._middle = _tight(QVBoxLayout())
        self.shelf = Shelf(strip, self)
        self._middle.addWidget(self.shelf)
        self._middle.addWidget(self.split, 1)
        self._middle.addWidget(below)
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


class Side(QScrollArea):
    """The panels below each other, with rules between them; the last takes what is left.

    Where their height is not there, they are asked to be content with less before it scrolls.
    """

    def __init__(self, panels: Sequence[Panel]) -> None:
        super().__init__()
        self._panels = panels
        inside = QWidget()
        column = _tight(QVBoxLayout(inside))
        for i, panel in enumerate(panels):
            if i > 0:
                column.addWidget(_rule())
            column.addWidget(panel, 1 if i == len(panels) - 1 else 0)
        self.setWidget(inside)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFixedWidth(PANEL_WIDTH)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Tell the panels whether the window is low."""
        super().resizeEvent(event)
        for panel in self._panels:
            panel.set_low(self.height() < LOW)


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
