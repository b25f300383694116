"""Held key: B shows the form as it was opened for as long as it is held."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QLineEdit, QWidget

from app.stage import Stage


class HeldKey(QObject):
    """Watches the keys of the whole application: the focus may be anywhere outside a text."""

    def __init__(self, stage: Stage, window: QWidget) -> None:
        super().__init__(window)
        self._stage = stage
        self._window = window
        self._application = QApplication.instance()
        assert self._application is not None
        self._application.installEventFilter(self)

    def stop(self) -> None:
        """Watch no more keys, for closing."""
        assert self._application is not None
        self._application.removeEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """B held shows the original, wherever the focus is outside a text."""
        if event.type() in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            assert isinstance(event, QKeyEvent)
            typing = isinstance(QApplication.focusWidget(), (QLineEdit, QAbstractSpinBox))
            if event.key() == Qt.Key.Key_B and not event.modifiers() and not typing:
                if self._window.isActiveWindow() and not event.isAutoRepeat():
                    self._stage.show_original(event.type() == QEvent.Type.KeyPress)
                return False
        elif event.type() == QEvent.Type.WindowDeactivate and watched is self._window:
            self._stage.show_original(False)
        return super().eventFilter(watched, event)
