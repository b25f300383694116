"""The first minute: a dashed lasso that invites, and three steps that are ticked off as done."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QObject, QSettings, Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel

from app.look import Theme, icon
from app.session import Session
from app.viewport import Viewport
from engine.arrays import F64

DONE = "welcome/done"
STEPS = (
    "Circle a part of the form",
    "Draw a curve on it",
    "Draw where it should go, then Enter",
)
LAST_WORDS = "Your steps are kept on the right: click one to go back to it"
MARGIN = 16


class Welcome(QFrame):
    """Shown at the first start only; each step is ticked when the person has done it."""

    def __init__(self, session: Session, viewport: Viewport) -> None:
        super().__init__(viewport)
        self.setObjectName("welcome")
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAccessibleName("First steps")
        self._session = session
        self._viewport = viewport
        self._theme: Theme | None = None
        self._reached = 0
        grid = QGridLayout(self)
        # Narrow: it lies over the form in a small window.
        grid.setContentsMargins(12, 8, 12, 8)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(8)
        self._signs = [QLabel(self) for _ in STEPS]
        self._lines = [QLabel(text, self) for text in STEPS]
        for row, (sign, line) in enumerate(zip(self._signs, self._lines, strict=True)):
            sign.setFixedSize(20, 20)
            grid.addWidget(sign, row, 0)
            grid.addWidget(line, row, 1)
        self.move(MARGIN, MARGIN)
        self.hide()
        session.document_changed.connect(self._follow)
        session.applied.connect(self._finished)
        viewport.pointer.connect(self._touched)
        viewport.camera_changed.connect(self._invite)

    @property
    def reached(self) -> int:
        """How many of the three steps are done."""
        return self._reached

    def begin(self) -> None:
        """Invite, unless the person has done it all before."""
        if not QSettings().value(DONE, False, type=bool):
            self._viewport.installEventFilter(self)
            self.show()
            self._show()
            self._invite()

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self._show()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep the invitation around the form when the viewport changes its size."""
        if event.type() == QEvent.Type.Resize:
            self._invite()
        return super().eventFilter(watched, event)

    def _invite(self) -> None:
        document = self._session.document
        if self.isHidden() or document is None:
            return
        inviting = self._reached == 0 and document.draft.roi is None
        path = belly(self._viewport.view().project(document.mesh.vertices)) if inviting else None
        self._viewport.overlay.set_invitation(path)

    def _touched(self, pointer: object) -> None:
        if not self.isHidden() and getattr(pointer, "kind", "") == "press":
            self._viewport.overlay.set_invitation(None)

    def _follow(self) -> None:
        document = self._session.document
        if self.isHidden() or document is None:
            return
        draft = document.draft
        if draft.roi is None:
            self._reached = 0
        elif draft.source is None and not draft.strokes:
            self._reached = 1
        else:
            self._reached = 2
        self._show()
        self._invite()

    def _finished(self) -> None:
        if self.isHidden():
            return
        self.hide()
        self._viewport.removeEventFilter(self)
        self._viewport.overlay.set_invitation(None)
        QSettings().setValue(DONE, True)
        self._session.noticed.emit(LAST_WORDS)

    def _show(self) -> None:
        theme = self._theme
        if theme is None:
            return
        self.setStyleSheet(
            f"#welcome {{ background: {theme.panel}; border: 1px solid {theme.border};"
            " border-radius: 8px; }"
        )
        for row, (sign, line) in enumerate(zip(self._signs, self._lines, strict=True)):
            done, now = row < self._reached, row == self._reached
            name = "mdi6.check-circle" if done else f"mdi6.numeric-{row + 1}-circle-outline"
            colour = theme.accent if done or now else theme.faint
            sign.setPixmap(icon(name, theme, colour).pixmap(20, 20))
            line.setStyleSheet(
                f"color: {theme.text if now else theme.faint}; font-weight: {600 if now else 400};"
            )
        self.adjustSize()
        self.raise_()


def belly(seen: F64) -> F64:
    """Return an ellipse (p, 2) px around the widest part of a form seen at `seen` (n, 2) px."""
    low, high = seen.min(axis=0), seen.max(axis=0)
    bands = np.linspace(low[1], high[1], 13)
    row = np.clip(np.searchsorted(bands, seen[:, 1]) - 1, 0, 11)
    left, right = np.full(12, np.inf), np.full(12, -np.inf)
    np.minimum.at(left, row, seen[:, 0])
    np.maximum.at(right, row, seen[:, 0])
    width = right - left
    wide = np.flatnonzero(width >= 0.95 * width.max())
    middle = (left[wide] + right[wide]).mean() / 2
    centre = np.array([middle, (bands[wide] + bands[wide + 1]).mean() / 2])
    half = 0.36 * width.max()
    t = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    return np.asarray(centre + np.column_stack([half * np.cos(t), 0.85 * half * np.sin(t)]))
