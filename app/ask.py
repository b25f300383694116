"""Ask: one line to type a name into, over the window; Enter takes it, Escape leaves it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import QLabel, QLineEdit, QVBoxLayout, QWidget

WIDTH = 320


class Ask(QWidget):
    """A popup with a line.

    Parameters
    ----------
    parent : what it appears over.
    form : gets the keys when it goes.
    """

    def __init__(self, parent: QWidget, form: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._form = form
        self._over = parent
        self.setObjectName("ask")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setStyleSheet("#ask { background: palette(window); border: 1px solid palette(mid); }")
        self._words = QLabel(self)
        self.line = QLineEdit(self)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 12, 12, 12)
        column.setSpacing(8)
        column.addWidget(self._words)
        column.addWidget(self.line)
        self._then: Callable[[str], object] | None = None
        self.line.returnPressed.connect(self._take)

    def ask(self, words: str, suggestion: str, then: Callable[[str], object]) -> None:
        """Show `words` and a suggestion; `then` gets what was typed."""
        over = self._over
        self._then = then
        self._words.setText(words)
        self.line.setAccessibleName(words)
        self.line.setText(suggestion)
        self.line.selectAll()
        self.resize(WIDTH, self.sizeHint().height())
        corner = over.mapToGlobal(over.rect().topLeft())
        self.move(corner.x() + (over.width() - WIDTH) // 2, corner.y() + 96)
        self.show()
        self.line.setFocus()

    def hideEvent(self, event: QHideEvent) -> None:
        """Give the keys to the form, not to whatever comes next in the window."""
        super().hideEvent(event)
        self._form.setFocus()

    def _take(self) -> None:
        text = self.line.text().strip()
        self.hide()
        if text and self._then is not None:
            self._then(text)
