"""Steps panel: everything done since opening, to go back to; what was undone stays."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QWidget

from app.panels.panel import Panel
from app.session import Session


class StepsPanel(Panel):
    """The way from the opened mesh to the current document, and what redo would lead to."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__("Steps", parent)
        self._session = session
        self.list = QListWidget(self)
        self.list.setAccessibleName("Steps")
        self.list.setMinimumHeight(120)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.itemClicked.connect(self._clicked)
        self.list.itemActivated.connect(self._clicked)
        self.body.addWidget(self.list)
        session.document_changed.connect(self.refresh)

    def refresh(self) -> None:
        """Show the history as it is now."""
        history = self._session.history
        with QSignalBlocker(self.list):
            self.list.clear()
            if history is None:
                return
            for moment in sorted(history.moments.values(), key=lambda one: one.id):
                item = QListWidgetItem(moment.name or moment.label)
                item.setData(Qt.ItemDataRole.UserRole, moment.id)
                self.list.addItem(item)
                if moment.id == history.current_id:
                    self.list.setCurrentItem(item)
                    self.list.scrollToItem(item)

    def _clicked(self, item: QListWidgetItem) -> None:
        self._session.go(int(item.data(Qt.ItemDataRole.UserRole)))
