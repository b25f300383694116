"""Command palette: every action of the table, found by typing a few letters of it."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt
from PySide6.QtGui import QIcon, QKeyEvent, QKeySequence, QPixmap
from PySide6.QtWidgets import (
    QDialog,
    QHeaderView,
    QLineEdit,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.actions import NATIVE, Actions

WIDTH = 480
ROW = 32


class Palette(QDialog):
    """A line to type in and the actions that match, best first; Enter does the one chosen."""

    def __init__(self, actions: Actions, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._over = parent
        self._actions = actions
        room = QPixmap(16, 16)
        room.fill(Qt.GlobalColor.transparent)
        self._none = QIcon(room)  # actions without an icon line up with the others
        self.line = QLineEdit(self)
        self.line.setPlaceholderText("What do you want to do?")
        self.line.setAccessibleName("Find a command")
        self.list = QTreeWidget(self)
        self.list.setAccessibleName("Commands")
        self.list.setHeaderHidden(True)
        self.list.setRootIsDecorated(False)
        self.list.setUniformRowHeights(True)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setColumnCount(2)
        self.list.header().setStretchLastSection(False)
        self.list.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.list.header().setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 8)
        column.setSpacing(8)
        column.addWidget(self.line)
        column.addWidget(self.list)
        self.line.textChanged.connect(self._fill)
        self.line.installEventFilter(self)
        self.list.itemClicked.connect(lambda _item, _column: self._do())

    def open(self) -> None:
        """Show the palette near the top of the window."""
        over = self._over
        self.line.clear()
        self._fill("")
        self.resize(WIDTH, 384)
        corner = over.mapToGlobal(over.rect().topLeft())
        self.move(corner.x() + (over.width() - WIDTH) // 2, corner.y() + 80)
        self.show()
        self.line.setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Arrows walk the list and Enter does it, while the line keeps the focus."""
        if watched is self.line and event.type() == QEvent.Type.KeyPress:
            assert isinstance(event, QKeyEvent)
            step = {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1}.get(Qt.Key(event.key()))
            if step is not None:
                self._choose(self.list.currentIndex().row() + step)
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
            menu = self._actions.table[name].group
            item = QTreeWidgetItem(self.list, [f"{menu}: {title}" if menu else title, shown])
            item.setData(0, Qt.ItemDataRole.UserRole, name)
            item.setSizeHint(0, QSize(0, ROW))
            item.setTextAlignment(1, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            own = self._actions.qt[name].icon()
            item.setIcon(0, self._none if own.isNull() else own)
        self._choose(0)

    def _choose(self, row: int) -> None:
        """Go to a row, or to the one nearest to it that there is."""
        row = min(max(row, 0), self.list.topLevelItemCount() - 1)
        item = self.list.topLevelItem(row)
        if item is not None:
            self.list.setCurrentItem(item)

    def _do(self) -> None:
        item = self.list.currentItem()
        self.hide()
        if item is not None:
            self._actions.trigger(item.data(0, Qt.ItemDataRole.UserRole))


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
