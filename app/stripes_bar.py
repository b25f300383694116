"""Stripes bar: how many stripes the form reflects, and which way they lie."""

from __future__ import annotations

import typing
from dataclasses import replace

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt
from PySide6.QtWidgets import QHBoxLayout, QSlider

from app.overlying import Overlying
from app.panels.panel import GRID, Choice
from app.viewport import Viewport
from app.viewport.overlay import LEGEND_ABOVE
from app.viewport.shading import FEWEST, MOST, Way

MARGIN = 12


class StripesBar(Overlying):
    """Lies where a map has its scale; there while the form is seen in stripes or lines."""

    def __init__(self, viewport: Viewport) -> None:
        super().__init__(viewport, "stripes")
        self._viewport = viewport
        self.setAccessibleName("Stripes")
        self.way = Choice(self)
        for way in typing.get_args(Way):
            self.way.addItem(way.capitalize(), way)
        self.way.setAccessibleName("Way of the stripes")
        self.way.setToolTip("Horizontal stripes stay upright with the form, the others with you")
        self.way.activated.connect(lambda _i: self._set())
        self.count = QSlider(Qt.Orientation.Horizontal, self)
        self.count.setRange(FEWEST, MOST)
        self.count.setFixedWidth(96)
        self.count.setMinimumHeight(32)
        self.count.setAccessibleName("Number of stripes")
        self.count.setToolTip("More stripes show finer flaws")
        self.count.valueChanged.connect(lambda _value: self._set())
        row = QHBoxLayout(self)
        row.setContentsMargins(GRID, GRID // 2, GRID * 2, GRID // 2)
        row.setSpacing(GRID)
        row.addWidget(self.way)
        row.addWidget(self.count)
        viewport.looks_changed.connect(self.refresh)

    def refresh(self) -> None:
        """Show how the stripes are, where there are any."""
        stripes = self._viewport.stripes
        with QSignalBlocker(self.count):
            self.count.setValue(stripes.count)
        self.way.setCurrentIndex(self.way.findData(stripes.way))
        striped = self._viewport.display in ("zebra", "reflection")
        if striped and self.isHidden():
            self.show()
            self._place()
        elif not striped and not self.isHidden():
            if self.isAncestorOf(self.window().focusWidget() or self._viewport):
                self._viewport.setFocus()  # else the keys would go to whatever comes next
            self.hide()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when the viewport changes its size."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return super().eventFilter(watched, event)

    def _place(self) -> None:
        self.adjustSize()
        over = self._viewport
        self.move(
            over.width() - self.width() - MARGIN, over.height() - LEGEND_ABOVE - self.height()
        )
        self.raise_()

    def _set(self) -> None:
        stripes = replace(
            self._viewport.stripes, count=self.count.value(), way=self.way.currentData()
        )
        self._viewport.set_stripes(stripes)
