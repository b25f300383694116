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
        # Every event of the application comes by: what it is costs more to ask than whose it is.
        if isinstance(event, QKeyEvent):
            pressed = event.type() == QEvent.Type.KeyPress
            if pressed or event.type() == QEvent.Type.KeyRelease:
                self._key(event, pressed)
        elif watched is self._window and event.type() == QEvent.Type.WindowDeactivate:
            self._stage.show_original(False)
        return False

    def _key(self, event: QKeyEvent, pressed: bool) -> None:
        if event.key() != Qt.Key.Key_B or event.modifiers() or event.isAutoRepeat():
            return
        typing = isinstance(QApplication.focusWidget(), (QLineEdit, QAbstractSpinBox))
        if not typing and self._window.isActiveWindow():
            self._stage.show_original(pressed)
