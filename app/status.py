"""Status bar: what is open, how far the modes are, and progress with a cross to cancel."""

from __future__ import annotations

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QLabel, QProgressBar, QSizePolicy, QStatusBar, QToolButton, QWidget

from app.look import Theme, icon
from app.session import Session
from app.sizes import likely_unit
from engine import Document
from engine.figures import figure

SHOWN_AFTER = 150  # ms: what is done sooner needs no bar
STILL_AFTER = 500  # ms without a move of the form under the hand
WORDS = {
    "file": "File",
    "write": "Writing",
    "decompose": "Region",
    "prepare": "Curve",
    "solve": "Form",
    "apply": "Details",
}
ORDER = ("file", "apply", "decompose", "prepare", "solve")
UNMEASURED = ("file", "write", "solve")  # may never say how far they are


class Status(QStatusBar):
    """One line of figures, and the progress of the slowest work.

    Signals
    -------
    size_asked : the size was clicked.
    """

    size_asked = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setSizeGripEnabled(False)
        self._count = QLabel(self)
        self._count.setContentsMargins(12, 0, 0, 0)
        self.size_button = QToolButton(self)
        self.size_button.setAutoRaise(True)
        self.size_button.setToolTip("What is known of the file, and what one unit of it is")
        self.size_button.clicked.connect(self.size_asked)
        self._figures = QLabel(self)
        self._words = QLabel(self)
        self._bar = QProgressBar(self)
        self._bar.setRange(0, 1000)
        self._bar.setTextVisible(False)
        self._bar.setFixedWidth(160)
        self._cross = QToolButton(self)
        self._cross.setAccessibleName("Cancel")
        self._cross.setToolTip("Cancel this work")
        self._cross.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._cross.clicked.connect(self.cancel)
        self.addWidget(self._count)
        self.addWidget(self.size_button)
        self.addWidget(self._figures, 1)
        for widget in (self._words, self._bar, self._cross):
            self.addPermanentWidget(widget)
            widget.hide()
        self._channel = ""
        self._late = QTimer(self)
        self._late.setSingleShot(True)
        self._late.setInterval(SHOWN_AFTER)
        self._late.timeout.connect(self._appear)
        session.progressed.connect(self._progressed)
        session.busy_changed.connect(self._keep_up)
        session.document_changed.connect(self._keep_up)
        session.decomposition_changed.connect(self._keep_up)
        session.shown_changed.connect(self._moved)

    @property
    def figures(self) -> str:
        """The line of figures."""
        parts = self._count.text(), self.size_button.text(), self._figures.text()
        return "    ".join(part for part in parts if part)

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._cross.setIcon(icon("mdi6.close", theme))

    def cancel(self) -> None:
        """Stop the work that the bar shows."""
        if self._channel:
            self._session.cancel(self._channel)

    def _keep_up(self) -> None:
        self._session.turn.once(self.refresh)

    def refresh(self) -> None:
        """Show the figures of the current document, and whether work is under way."""
        document = self._session.document
        self.size_button.setVisible(document is not None)
        if document is not None:
            self._count.setText(f"{document.mesh.n:,} vertices")
            self.size_button.setText(_size(document))
            self._figures.setText(self._line(document))
        working = (one for one in ORDER if self._session.jobs.busy(one))
        busy = next(working, "write" if self._session.writing.busy else "")
        if busy != self._channel:
            self._channel = busy
            self._words.setText(WORDS.get(busy, ""))
            self._advance(0 if busy in UNMEASURED else 1000, 0)
            self._late.setInterval(STILL_AFTER if busy == "solve" else SHOWN_AFTER)
            self._late.stop()
        if not busy:
            self._disappear()
        elif not self._bar.isVisible() and not self._late.isActive():
            self._late.start()

    def _moved(self) -> None:
        if self._channel == "solve":
            self._disappear()  # the form follows the hand: nobody waits for it
        self._keep_up()

    def _disappear(self) -> None:
        self._late.stop()
        for widget in (self._words, self._bar, self._cross):
            widget.hide()

    def _appear(self) -> None:
        if self._channel:
            for widget in (self._words, self._bar, self._cross):
                widget.show()

    def _progressed(self, channel: str, fraction: float, text: str) -> None:
        if channel.partition(" ")[0] != self._channel:
            return
        known = self._session.decomposition
        if channel == "decompose" and known is not None and known.k:
            text = "Modes"  # how many there are stands among the figures
        self._advance(1000, round(fraction * 1000))
        self._words.setText(text)

    def _advance(self, most: int, value: int) -> None:
        # Qt repaints a bar, and the form below it, at once and not with the next frame.
        self._bar.setUpdatesEnabled(False)
        self._bar.setRange(0, most)
        self._bar.setValue(value)
        self._bar.setUpdatesEnabled(True)

    def _line(self, document: Document) -> str:
        """Return the figures of the region and its curves."""
        draft = document.draft
        parts: list[str] = []
        if draft.roi is not None:
            parts.append(f"region {len(draft.roi):,}")
            known = self._session.decomposition
            if known is not None and known.k:
                more = "" if known.complete else "…"
                parts.append(f"{known.k:,} modes{more}")
        error = self._session.target_error
        if error is not None:
            parts.append(f"target error {error:.1f} px")
        return "    ".join(parts)


def _size(document: Document) -> str:
    """Return how large a model is, with a question mark where its unit is doubtful."""
    low, high = document.mesh.bounds
    size = " × ".join(figure(extent) for extent in high - low)
    doubt = " ?" if likely_unit(document) is not None else ""
    return f"{size} {document.unit}{doubt}"
