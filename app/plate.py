"""Plate: a quiet frame over the viewport with a title, lines and buttons; it blocks nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from PySide6.QtCore import QEvent, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.free_place import MARGIN, beside, covered, free_place
from engine.arrays import F64

WIDTHS = 520, 360, 280
NARROWEST = 160
_MOVES = (QEvent.Type.Move, QEvent.Type.Resize, QEvent.Type.Show)
_DIRECT = Qt.FindChildOption.FindDirectChildrenOnly
BESIDE = 28  # px of the plate beside its words
MOST_LINES = 8


class Plate(QFrame):
    """Lies in a corner of what it is over, where it does not cover the form; one at a time.

    Parameters
    ----------
    over : what it lies over.
    form : gives points of the form as they are seen, (p, 2) px.
    """

    def __init__(self, over: QWidget, form: Callable[[], F64] = lambda: np.zeros((0, 2))) -> None:
        super().__init__(over)
        self._over = over
        self._form = form
        # Not QTimer.singleShot: it keeps what it has called, and with it the whole window.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self.settle)
        # A pen on the plate does not draw on the form below it.
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.setObjectName("plate")
        self.setStyleSheet(
            "#plate { background: palette(window); border: 1px solid palette(mid);"
            " border-radius: 8px; }"
        )
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._title = QLabel(self)
        self._title.setStyleSheet("font-weight: 600;")
        self._text = QLabel(self)
        self._text.setWordWrap(True)
        # A file's name may look like markup.
        for label in (self._title, self._text):
            label.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._grid = QGridLayout()
        self._grid.setSpacing(8)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 12, 12, 12)
        column.setSpacing(8)
        column.addWidget(self._title)
        column.addWidget(self._text)
        row = QHBoxLayout()
        row.addStretch(1)
        row.addLayout(self._grid)
        column.addLayout(row)
        self.buttons: dict[str, QPushButton] = {}
        self.hide()
        over.installEventFilter(self)

    @property
    def text(self) -> str:
        """What the plate says."""
        return f"{self._title.text()}\n{self._text.text()}"

    def say(
        self, title: str, lines: Sequence[str], buttons: Mapping[str, Callable[[], object]]
    ) -> None:
        """Show a title, some lines and buttons; every button also closes the plate."""
        more = len(lines) - MOST_LINES
        shown = list(lines[:MOST_LINES]) + ([f"… and {more} more"] if more > 0 else [])
        self._title.setText(title)
        self._text.setText("\n".join(shown))
        for button in self.buttons.values():
            self._grid.removeWidget(button)
            button.deleteLater()
        self.buttons = {}
        for words, callback in buttons.items():
            button = QPushButton(words, self)
            button.clicked.connect(self.hide)
            button.clicked.connect(lambda _on=False, call=callback: call())
            self.buttons[words] = button
        self.setAccessibleName(title)
        for one in self._over.findChildren(QWidget, options=_DIRECT):
            if one is not self:
                one.installEventFilter(self)  # once, however often it is asked for
        self.show()
        self._place()
        # The view may still be on its way to what was opened.
        self._soon.start()

    def settle(self) -> None:
        """Go out of the way of what it covers now: the form, the hint, a bar."""
        if not self.isVisible():
            return
        others = [one.geometry() for one in beside(self)]
        if covered(self.geometry(), others, self._form()) > 0:
            self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when the viewport changes its size, and out of the way of others there."""
        if self.isVisible():
            if watched is self._over and event.type() == QEvent.Type.Resize:
                self._place()
            elif watched is not self._over and event.type() in _MOVES:
                self._soon.start()
        return super().eventFilter(watched, event)

    def hideEvent(self, event: QHideEvent) -> None:
        """Give the keys to the form, not to whatever comes next in the window."""
        super().hideEvent(event)
        if self._over.isVisible():
            self._over.setFocus()

    def _place(self) -> None:
        most = self._over.width() - 2 * MARGIN
        widths = [max(min(wide, most), NARROWEST) for wide in WIDTHS]
        sizes = [self._taken(wide) for wide in widths]
        others = [one.geometry() for one in beside(self)]
        which, corner = free_place(self._over.size(), sizes, others, self._form())
        self._taken(widths[which])
        self.move(corner)
        self.raise_()

    def _taken(self, wide: int) -> QSize:
        """Take a width; return the size with it."""
        self.setFixedWidth(wide)
        inside = wide - BESIDE
        self._text.setFixedSize(inside, self._text.heightForWidth(inside))
        buttons = list(self.buttons.values())
        widest = [button.sizeHint().width() for button in buttons]
        gap = self._grid.spacing()
        columns = len(buttons)
        if sum(widest) + gap * (columns - 1) > inside:
            columns = max(1, (inside + gap) // (max(widest) + gap))
        for i, button in enumerate(buttons):
            self._grid.addWidget(button, i // columns, i % columns)
        layout = self.layout()
        assert layout is not None
        layout.activate()
        self.adjustSize()
        return self.size()
