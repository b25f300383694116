"""Plate: a quiet frame over the viewport with a title, lines and buttons; it blocks nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from app.free_place import MARGIN
from app.overlying import Evasive
from engine.arrays import F64

WIDTHS = 520, 360, 280
NARROWEST = 160
BESIDE = 28  # px of the plate beside its words
MOST_LINES = 8


class Plate(Evasive):
    """Lies in a corner of what it is over, where it does not cover the form; one at a time.

    Parameters
    ----------
    over : what it lies over.
    form : gives points of the form as they are seen, (p, 2) px.
    """

    def __init__(self, over: QWidget, form: Callable[[], F64] = lambda: np.zeros((0, 2))) -> None:
        super().__init__(over, "plate", form=form)
        self._title = self.plain_label()
        self._title.setStyleSheet("font-weight: 600;")
        self._text = self.plain_label()
        self._text.setWordWrap(True)
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
        self.appear()

    def hideEvent(self, event: QHideEvent) -> None:
        """Give the keys to the form, not to whatever comes next in the window."""
        super().hideEvent(event)
        if self._over.isVisible():
            self._over.setFocus()

    def widths(self) -> list[int]:
        """Return the widths it may have now, px, the best first."""
        most = self._over.width() - 2 * MARGIN
        return [max(min(wide, most), NARROWEST) for wide in WIDTHS]

    def laid_out(self, width: int) -> QSize:
        """Lay out the words and buttons for a width; return the size that takes."""
        self.setFixedWidth(width)
        inside = width - BESIDE
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
