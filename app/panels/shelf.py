"""Shelf: a row of controls that never makes the window wider; what has no room is slid into it."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QScrollArea, QSizePolicy, QToolButton, QWidget

from app.look import Theme, icon


class Shelf(QWidget):
    """Shows a row as far as there is room; a button at its end goes on to the rest, and back.

    Attributes
    ----------
    more : the button, there only while something has no room.
    """

    def __init__(self, row: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._inside = row
        self._theme: Theme | None = None
        self._area = QScrollArea(self)
        self._area.setWidget(row)
        self._area.setWidgetResizable(True)
        self._area.setFrameShape(QFrame.Shape.NoFrame)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        off = Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self._area.setHorizontalScrollBarPolicy(off)
        self._area.setVerticalScrollBarPolicy(off)
        self._area.viewport().setAutoFillBackground(False)
        row.setAutoFillBackground(False)
        self._slide = self._area.horizontalScrollBar()
        self.more = QToolButton(self)
        self.more.setAutoRaise(True)
        self.more.setAccessibleName("More options")
        self.more.setToolTip("There is more than fits: on to the rest, or back")
        self.more.clicked.connect(self._go_on)
        self.more.hide()
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(0)
        line.addWidget(self._area, 1)
        line.addWidget(self.more)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        row.installEventFilter(self)
        self._slide.valueChanged.connect(self._show_way)

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self._show_way()

    def minimumSizeHint(self) -> QSize:
        """Ask for little width, and for the height of the row."""
        return QSize(120, max(self._inside.minimumHeight(), 32))

    def sizeHint(self) -> QSize:
        """Ask for as much as the row would take."""
        return QSize(self._inside.sizeHint().width(), self.minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Offer the rest where there is one."""
        super().resizeEvent(event)
        self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Look again when the row holds other controls."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._fit()
        return super().eventFilter(watched, event)

    def _fit(self) -> None:
        self.more.setVisible(self._inside.minimumSizeHint().width() > self.width())
        self._show_way()

    def _go_on(self) -> None:
        back = self._slide.value() == self._slide.maximum()
        self._slide.setValue(0 if back else self._slide.value() + self._area.width() // 2)

    def _show_way(self) -> None:
        if self._theme is not None:
            back = self._slide.maximum() > 0 and self._slide.value() == self._slide.maximum()
            name = "mdi6.chevron-left" if back else "mdi6.chevron-right"
            self.more.setIcon(icon(name, self._theme))
