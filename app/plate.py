"""Plate: a quiet frame over the viewport with a title, lines and buttons; it blocks nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

MARGIN = 16
WIDEST = 520
MOST_LINES = 8


class Plate(QFrame):
    """Lies at the upper left of what it is over; one at a time."""

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self._over = over
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
        self._row = QHBoxLayout()
        self._row.setSpacing(8)
        self._row.addStretch(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 12, 12, 12)
        column.setSpacing(8)
        column.addWidget(self._title)
        column.addWidget(self._text)
        column.addLayout(self._row)
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
            self._row.removeWidget(button)
            button.deleteLater()
        self.buttons = {}
        for words, callback in buttons.items():
            button = QPushButton(words, self)
            button.clicked.connect(self.hide)
            button.clicked.connect(lambda _on=False, call=callback: call())
            self._row.addWidget(button)
            self.buttons[words] = button
        self.setAccessibleName(title)
        self.show()
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when the viewport changes its size."""
        if event.type() == QEvent.Type.Resize and self.isVisible():
            self._place()
        return super().eventFilter(watched, event)

    def _place(self) -> None:
        wide = min(WIDEST, self._over.width() - 2 * MARGIN)
        self.setFixedWidth(max(wide, 160))
        self._text.setFixedWidth(max(wide - 28, 120))
        self.adjustSize()
        self.move(MARGIN, MARGIN)
        self.raise_()
