"""A new palette for widgets that a style sheet dresses, some of them in each turn of the loop."""

from __future__ import annotations

import time
from collections.abc import Iterator

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QApplication, QWidget
from shiboken6 import isValid

TURN_SECONDS = 0.012  # of styling before the window may do something else


class Restyle(QObject):
    """Has every widget take its style anew; nothing is painted until all have.

    A style sheet keeps the colours that it looked up for a widget, and setting it again asks for
    all of them at once: 50 to 300 ms, in which the window answers to nothing.
    """

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._application = application
        self._left: Iterator[QWidget] = iter(())
        self._frozen: list[QWidget] = []
        self._next = QTimer(self)
        self._next.setInterval(0)
        self._next.timeout.connect(self._some)

    @property
    def under_way(self) -> bool:
        """Whether some widgets still have their old colours, and nothing is painted."""
        return self._next.isActive()

    def begin(self) -> None:
        """Restyle all widgets that there are; those made later have the new colours anyway."""
        self._thaw()
        self._frozen = [
            one
            for one in self._application.topLevelWidgets()
            if one.isVisible() and one.updatesEnabled()
        ]
        for one in self._frozen:
            one.setUpdatesEnabled(False)
        self._left = iter(self._application.allWidgets())
        self._next.start()

    def _some(self) -> None:
        until = time.perf_counter() + TURN_SECONDS
        for widget in self._left:
            if isValid(widget):
                style = widget.style()
                style.unpolish(widget)
                style.polish(widget)
            if time.perf_counter() > until:
                return
        self._next.stop()
        self._thaw()

    def _thaw(self) -> None:
        frozen, self._frozen = self._frozen, []
        for one in frozen:
            if isValid(one):
                one.setUpdatesEnabled(True)
