"""Command palette: every action of the table, found by typing a few letters of it."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QDialog, QLineEdit, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from app.actions import NATIVE, Actions

WIDTH = 480


class Palette(QDialog):
    """A line to type in and the actions that match, best first; Enter does the one chosen."""

    def __init__(self, actions: Actions, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._actions = actions
        self.line = QLineEdit(self)
        self.line.setPlaceholderText("What do you want to do?")
        self.line.setAccessibleName("Find a command")
        self.list = QListWidget(self)
        self.list.setAccessibleName("Commands")
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 8)
        column.setSpacing(8)
        column.addWidget(self.line)
        column.addWidget(self.list)
        self.line.textChanged.connect(self._fill)
        self.line.installEventFilter(self)
        self.list.itemClicked.connect(lambda _item: self._do())

    def open(self) -> None:
        """Show the palette near the top of the window."""
        parent = self.parentWidget()
        self.line.clear()
        self._fill("")
        self.resize(WIDTH, 384)
        corner = parent.mapToGlobal(parent.rect().topLeft())
        self.move(corner.x() + (parent.width() - WIDTH) // 2, corner.y() + 80)
        self.show()
        self.line.setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Arrows walk the list and Enter does it, while the line keeps the focus."""
        if watched is self.line and event.type() == QEvent.Type.KeyPress:
            assert isinstance(event, QKeyEvent)
            step = {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1}.get(Qt.Key(event.key()))
            if step is not None:
                row = min(max(self.list.currentRow() + step, 0), self.list.count() - 1)
                self.list.setCurrentRow(row)
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._do()
                return True
        return super().eventFilter(watched, event)

    def _fill(self, text: str) -> None:
        self.list.clear()
        ranked = sorted(
            (score, action.title, name)
            for name, action in self._actions.table.items()
            if self._actions.qt[name].isEnabled()
            and (score := match(text, f"{action.menu} {action.title}")) is not None
        )
        for _, title, name in ranked:
            keys = self._actions.keys(name)
            shown = QKeySequence(keys[0]).toString(NATIVE) if keys else ""
            menu = self._actions.table[name].menu
            item = QListWidgetItem(f"{menu}: {title}\t{shown}" if menu else f"{title}\t{shown}")
            item.setData(Qt.ItemDataRole.UserRole, name)
            self.list.addItem(item)
        self.list.setCurrentRow(0)

    def _do(self) -> None:
        item = self.list.currentItem()
        self.hide()
        if item is not None:
            self._actions.trigger(item.data(Qt.ItemDataRole.UserRole))


def match(typed: str, text: str) -> tuple[int, int] | None:
    """Rank a text for what was typed, small is better; None when a letter is missing.

    A run of letters found whole comes before letters found one after the other.
    """
    wanted, text = typed.lower().strip(), text.lower()
    whole = text.find(wanted)
    if whole >= 0:
        return (0, whole)
    at = -1
    gaps = 0
    for letter in wanted.replace(" ", ""):
        found = text.find(letter, at + 1)
        if found < 0:
            return None
        gaps += found - at - 1
        at = found
    return (1, gaps)
