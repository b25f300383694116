"""Compare: another moment of the history beside the current one, seen from the same place."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from app.look import Theme
from app.session import Session
from app.viewport import Viewport
from engine import Moment

MARGIN = 12


class Header(QFrame):
    """Words, and buttons if there are any, at the upper left of a viewport."""

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self.setObjectName("header")
        self.setStyleSheet(
            "#header { background: palette(window); border: 1px solid palette(mid);"
            " border-radius: 8px; }"
        )
        self._words = QLabel(self)
        self._words.setStyleSheet("font-weight: 600;")
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(12, 6, 12, 6)
        self._row.setSpacing(8)
        self._row.addWidget(self._words)
        self.move(MARGIN, MARGIN)
        self.hide()

    def add(self, words: str, tip: str, clicked: Callable[[], object]) -> None:
        """Put a button behind the words."""
        button = QPushButton(words, self)
        button.setToolTip(tip)
        button.clicked.connect(lambda _on=False: clicked())
        self._row.addWidget(button)

    def say(self, text: str) -> None:
        """Show `text`, or nothing."""
        self._words.setText(text)
        self.setVisible(bool(text))
        self.adjustSize()
        self.raise_()


class Compare(QWidget):
    """The second viewport with its own bar; made when it is wanted and closed with it.

    Signals
    -------
    closed : the person has seen enough.
    """

    closed = Signal()

    def __init__(self, session: Session, main: Viewport, theme: Theme, parent: QWidget) -> None:
        super().__init__(parent)
        self._session = session
        self._main = main
        self.moment: Moment | None = None
        self._linking = False
        self.viewport = Viewport(self, theme)
        self.header = Header(self.viewport)
        self.header.add("Swap", "Go to this step; the current one comes here", self.swap)
        self.header.add("Close", "Close the comparison", self.closed.emit)
        self.main_header = Header(main)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.viewport)
        session.document_changed.connect(self._follow)
        # Both look from the same place; `look_as` changes nothing when they already do.
        main.camera_changed.connect(self._look)
        self.viewport.camera_changed.connect(self._lead)

    def show_moment(self, moment: Moment) -> None:
        """Show a moment beside the current one."""
        self.moment = moment
        words = moment.name or moment.label
        self.header.say(words)
        self.viewport.set_mesh(moment.document.mesh)
        self.viewport.set_unit(moment.document.unit)
        self.viewport.set_reference(moment.document.original.vertices)
        self.viewport.set_display(self._main.display)
        self.viewport.look_as(self._main)
        self._follow()

    def swap(self) -> None:
        """Put each on the other's side."""
        history, before = self._session.history, self._session.moment
        if history is None or before is None or self.moment is None:
            return
        there = self.moment
        self._session.go(there.id)
        self.show_moment(before)

    def end(self) -> None:
        """Free the second viewport; call it before the widget goes."""
        self._session.document_changed.disconnect(self._follow)
        self._main.camera_changed.disconnect(self._look)
        self.main_header.say("")
        self.main_header.deleteLater()
        self.viewport.close()

    def _look(self) -> None:
        self._linked(self.viewport, self._main)

    def _lead(self) -> None:
        self._linked(self._main, self.viewport)

    def _linked(self, follower: Viewport, leader: Viewport) -> None:
        if not self._linking and self.moment is not None:
            self._linking = True
            follower.look_as(leader)
            self._linking = False

    def _follow(self) -> None:
        moment = self._session.moment
        self.main_header.say("" if moment is None else (moment.name or moment.label))
