"""A bar over the viewport that offers what can be restored; it asks nothing and blocks nothing."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QObject, QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QPushButton, QWidget

from app.free_place import MARGIN
from app.overlying import Evasive
from app.viewport.cube import SIZE as CUBE
from engine.arrays import F64
from engine.files.report import shown
from engine.journal import Recoverable

WIDEST = 860
NARROW = 560
BLOCKS = 400, 280  # px wide, where a line would cover the form
BESIDE_CUBE = 420


class RecoveryBar(Evasive):
    """One line with its buttons, or a block of it, where it does not cover the form.

    Parameters
    ----------
    over : the widget it lies over.
    form : gives points of the form as they are seen, (p, 2) px.
    """

    def __init__(self, over: QWidget, form: Callable[[], F64] = lambda: np.zeros((0, 2))) -> None:
        super().__init__(over, "recovery", "highlight", form)
        self.setAccessibleName("Restore unsaved work")
        self._text = self.plain_label()
        self._text.setWordWrap(True)
        self._row = QHBoxLayout()
        self._row.setSpacing(8)
        self._both = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._both.setContentsMargins(16, 8, 8, 8)
        self._both.setSpacing(8)
        self._both.addWidget(self._text, 1)
        self._both.addLayout(self._row)
        self.buttons: dict[str, QPushButton] = {}

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
        self.appear()

    def widths(self) -> list[int]:
        """Return the widths it may have now, px, the best first."""
        over = self._over
        # The view cube keeps its corner where there is room for both.
        room = over.width() - CUBE - 3 * MARGIN
        if room < BESIDE_CUBE:
            room = over.width() - 2 * MARGIN
        line = max(200, min(WIDEST, room))
        return [line, *(width for width in BLOCKS if width < line)]

    def laid_out(self, width: int) -> QSize:
        """Lay out the words and buttons for a width; return the size that takes."""
        # In little width the buttons stand below the sentence, none of them cut off.
        direction = QBoxLayout.Direction
        wide = width > NARROW
        self._both.setDirection(direction.LeftToRight if wide else direction.TopToBottom)
        return QSize(width, self._both.totalHeightForWidth(width))


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
