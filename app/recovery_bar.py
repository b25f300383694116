"""A bar over the viewport that offers what can be restored; it asks nothing and blocks nothing."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QBoxLayout, QFrame, QHBoxLayout, QLabel, QPushButton, QWidget

from app.viewport.cube import SIZE as CUBE
from engine.files.report import shown
from engine.journal import Recoverable

MARGIN = 16
WIDEST = 860
NARROW = 560
BESIDE_CUBE = 420


class RecoveryBar(QFrame):
    """One line with its buttons, at the upper edge of what it lies over.

    Parameters
    ----------
    over : the widget it lies over.
    """

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self._over = over
        # A pen on the bar does not draw on the form below it.
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.setObjectName("recovery")
        self.setAccessibleName("Restore unsaved work")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setStyleSheet(
            "#recovery { background: palette(window); border: 1px solid palette(highlight);"
            " border-radius: 8px; }"
        )
        self._text = QLabel(self)
        # A file's name may look like markup.
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(True)
        self._row = QHBoxLayout()
        self._row.setSpacing(8)
        self._both = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._both.setContentsMargins(16, 8, 8, 8)
        self._both.setSpacing(8)
        self._both.addWidget(self._text, 1)
        self._both.addLayout(self._row)
        self.buttons: dict[str, QPushButton] = {}
        self.hide()
        over.installEventFilter(self)

    @property
    def text(self) -> str:
        """The sentence that is shown."""
        return self._text.text()

    def say(self, text: str, buttons: dict[str, Callable[[], object]]) -> None:
        """Show a sentence and buttons; each of them is named by what it does."""
        self._text.setText(text)
        for button in self.buttons.values():
            self._row.removeWidget(button)
            button.deleteLater()
        self.buttons = {}
        for title, callback in buttons.items():
            button = QPushButton(title, self)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(lambda _checked=False, call=callback: call())
            self._row.addWidget(button)
            self.buttons[title] = button
        self.show()
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when what is below changes its size."""
        if event.type() == QEvent.Type.Resize:
            self._place()
        return super().eventFilter(watched, event)

    def _place(self) -> None:
        over = self._over
        # The view cube keeps its corner where there is room for both.
        room = over.width() - CUBE - 3 * MARGIN
        if room < BESIDE_CUBE:
            room = over.width() - 2 * MARGIN
        width = max(200, min(WIDEST, room))
        # In a narrow window the buttons stand below the sentence, none of them cut off.
        wide = width > NARROW
        direction = QBoxLayout.Direction
        self._both.setDirection(direction.LeftToRight if wide else direction.TopToBottom)
        self.setFixedSize(width, self._both.totalHeightForWidth(width))
        self.move(max(MARGIN, min((over.width() - width) // 2, MARGIN + room - width)), MARGIN)
        self.raise_()


class RecoveryOffers(QObject):
    """Goes through what can be restored, one after the other, in a bar.

    Parameters
    ----------
    bar : where it is offered.
    restore : opens a document.
    """

    def __init__(
        self, bar: RecoveryBar, restore: Callable[[Recoverable], None], parent: QObject
    ) -> None:
        super().__init__(parent)
        self._bar = bar
        self._restore = restore
        self._waiting: list[Recoverable] = []
        self._crashes: list[str] = []

    def offer(self, found: list[Recoverable], crashes: list[str]) -> None:
        """Show the first offer, if there is one; offers made before are let go of."""
        self.release()
        self._waiting, self._crashes = list(found), list(crashes)
        self._next()

    def release(self) -> None:
        """Leave what was not decided on for the next start."""
        for found in self._waiting:
            found.release()
        self._waiting = []
        self._bar.hide()

    def _next(self) -> None:
        if self._waiting:
            self._offer_document(self._waiting[0])
        elif self._crashes:
            self._offer_report(self._crashes[0])
        else:
            self._bar.hide()

    def _offer_document(self, found: Recoverable) -> None:
        others = len(self._waiting) - 1
        more = f" ({others} more after this)" if others else ""

        def restore() -> None:
            self._waiting.remove(found)
            self._next()
            self._restore(found)

        def discard() -> None:
            self._waiting.remove(found)
            found.discard()
            self._next()

        buttons: dict[str, Callable[[], object]] = {"Restore": restore, "Discard": discard}
        buttons["Later"] = self.release
        self._bar.say(sentence(found, crashed=bool(self._crashes)) + more, buttons)

    def _offer_report(self, report: str) -> None:
        def copy() -> None:
            QGuiApplication.clipboard().setText(report)
            self._bar.buttons["Copy report"].setText("Copied")

        def close() -> None:
            self._crashes.remove(report)
            self._next()

        self._bar.say(
            "Eigenform crashed the last time. Nothing else is lost; "
            "the report helps us to mend it.",
            {"Copy report": copy, "Close": close},
        )


def sentence(found: Recoverable, *, crashed: bool = False) -> str:
    """Say what is offered and why, in the person's words."""
    steps = len(found.state.current.recipe.steps)
    what = {0: "no step applied yet", 1: "one step"}.get(steps, f"{steps} steps")
    when = time.strftime("%H:%M", time.localtime(found.time))
    if time.time() - found.time > 20 * 3600:
        when = time.strftime("%d %B, %H:%M", time.localtime(found.time))
    happened = {
        "crash": "Eigenform crashed." if crashed else "Eigenform did not close properly.",
        "closed": "Eigenform was closed by the system.",
        "set aside": "This was closed without saving.",
    }[found.why]
    damage = " " + " ".join(found.report) if found.report else ""
    return f"{happened} “{shown(found.name)}” from {when} can be restored ({what}).{damage}"
