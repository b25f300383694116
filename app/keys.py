"""Keys: every action with its keys, found by typing, changed by pressing others."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QLineEdit,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.actions import NATIVE, Actions

NAME = Qt.ItemDataRole.UserRole
HANDS = (
    ("Draw", "Left drag, pen tip"),
    ("Turn", "Middle or right drag, pen button, Space + drag, arrow keys"),
    ("Move", "Shift + middle drag, Shift + pen button"),
    ("Zoom", "Wheel, Ctrl + middle drag, Ctrl + pen button"),
    ("Add to the region", "Shift while circling"),
    ("Take from the region", "Ctrl while circling, eraser end of the pen"),
    ("Size of the brush, of the handle", "Alt + drag sideways"),
    ("Size of the region", "Shift + wheel"),
    ("Draw without mouse and pen", "K, then arrow keys, Space and Enter"),
    ("Level of detail", "Alt + wheel"),
    ("See the original", "Hold B"),
    ("From part to part of the window", "F6, Shift + F6; Tab inside a part"),
)


class Keys(QDialog):
    """The sheet of keys."""

    def __init__(self, actions: Actions, parent: QWidget) -> None:
        super().__init__(parent)
        self._actions = actions
        self._rows: dict[str, QTreeWidgetItem] = {}
        self.setWindowTitle("Keys")
        self.resize(680, 640)
        self.line = QLineEdit(self)
        self.line.setPlaceholderText("Find")
        self.line.setAccessibleName("Find a key")
        self.line.textChanged.connect(self.fill)
        self.tree = QTreeWidget(self)
        self.tree.setHeaderHidden(True)
        self.tree.setStyleSheet("QTreeView::item { min-height: 24px; }")
        self.tree.setColumnCount(2)
        self.tree.setAccessibleName("Keys")
        self.tree.header().setStretchLastSection(False)
        self.tree.header().setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        self.tree.header().setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.tree.currentItemChanged.connect(lambda *_: self._chosen())
        self.edit = QKeySequenceEdit(self)
        self.edit.setMaximumSequenceLength(1)
        self.edit.setAccessibleName("New keys")
        self.edit.editingFinished.connect(self._typed)
        self.reset = QPushButton("As delivered", self)
        self.reset.setAutoDefault(False)
        self.reset.clicked.connect(self._reset)
        self.words = QLabel("Choose a command, then press its new keys", self)
        self.words.setWordWrap(True)
        row = QHBoxLayout()
        row.setSpacing(8)
        row.addWidget(self.edit, 1)
        row.addWidget(self.reset)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 16, 16, 16)
        column.setSpacing(8)
        column.addWidget(self.line)
        column.addWidget(self.tree, 1)
        column.addWidget(self.words)
        column.addLayout(row)
        self.fill()

    def fill(self) -> None:
        """List what matches the text typed."""
        wanted = self.line.text().lower().strip()
        self._rows.clear()
        self.tree.clear()
        groups: dict[str, QTreeWidgetItem] = {}

        def add(group: str, title: str, keys: str, name: str = "") -> None:
            if wanted and wanted not in f"{group} {title} {keys}".lower():
                return
            if group not in groups:
                groups[group] = QTreeWidgetItem(self.tree, [group])
                groups[group].setFirstColumnSpanned(True)
            item = QTreeWidgetItem(groups[group], [title, keys])
            item.setData(0, NAME, name)
            if name:
                self._rows[name] = item

        for title, keys in HANDS:
            add("Hands", title, keys)
        for name, action in self._actions.table.items():
            keys = ", ".join(QKeySequence(k).toString(NATIVE) for k in self._actions.keys(name))
            add(action.group or "Other", action.title.rstrip("…"), keys, name)
        self.tree.expandAll()
        self._chosen()

    def choose(self, name: str) -> None:
        """Go to the row of an action."""
        row = self._rows.get(name)
        if row is not None:
            self.tree.setCurrentItem(row)

    def _name(self) -> str:
        item = self.tree.currentItem()
        return "" if item is None else str(item.data(0, NAME) or "")

    def _chosen(self) -> None:
        name = self._name()
        self.edit.setEnabled(bool(name))
        self.reset.setEnabled(bool(name))
        keys = self._actions.keys(name) if name else ()
        self.edit.setKeySequence(QKeySequence(keys[0] if keys else ""))

    def _typed(self) -> None:
        name, text = self._name(), self.edit.keySequence().toString()
        if not name or (text,) == self._actions.keys(name)[:1]:
            return
        owner = self._actions.owner_of(text) if text else None
        if owner is not None and owner != name:
            title = self._actions.table[owner].title.rstrip("…")
            self.words.setText(f"{text} already does “{title}”. Press other keys.")
            self.edit.setKeySequence(QKeySequence(""))
            return
        self._actions.remap(name, (text,) if text else ())
        self._said(name)

    def _reset(self) -> None:
        name = self._name()
        if name:
            self._actions.remap(name, None)
            self._said(name)

    def _said(self, name: str) -> None:
        title = self._actions.table[name].title.rstrip("…")
        keys = ", ".join(QKeySequence(k).toString(NATIVE) for k in self._actions.keys(name))
        self.fill()
        self.choose(name)
        self.words.setText(f"“{title}” is now on {keys or 'no key'}")
