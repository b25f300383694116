"""Overlying: frames that lie over the viewport, and those that keep off the form below."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence

import numpy as np
from PySide6.QtCore import QEvent, QObject, QRect, QSize, Qt, QTimer
from PySide6.QtWidgets import QFrame, QLabel, QWidget

from app.free_place import beside, covered, free_place
from engine.arrays import F64

_MOVES = (QEvent.Type.Move, QEvent.Type.Resize, QEvent.Type.Show)
_DIRECT = Qt.FindChildOption.FindDirectChildrenOnly


class Overlying(QFrame):
    """A frame with a border over the viewport; a pen on it does not draw on the form below.

    Parameters
    ----------
    over : what it lies over; its events come to `eventFilter`.
    name : of the frame, for its style.
    edge : the palette's colour of the border.
    """

    def __init__(self, over: QWidget, name: str, edge: str = "mid") -> None:
        super().__init__(over)
        self._over = over
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.setObjectName(name)
        self.setStyleSheet(
            f"#{name} {{ background: palette(window); border: 1px solid palette({edge});"
            " border-radius: 8px; }"
        )
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.hide()
        over.installEventFilter(self)

    def plain_label(self) -> QLabel:
        """Make a label of plain text: a file's name may look like markup."""
        label = QLabel(self)
        label.setTextFormat(Qt.TextFormat.PlainText)
        return label


class Evasive(Overlying):
    """Lies in a corner of the viewport where it does not cover the form, or covers least of it.

    Parameters
    ----------
    form : gives points of the form as they are seen, (p, 2) px.
    """

    def __init__(
        self,
        over: QWidget,
        name: str,
        edge: str = "mid",
        form: Callable[[], F64] = lambda: np.zeros((0, 2)),
    ) -> None:
        super().__init__(over, name, edge)
        self._form = form
        # Not QTimer.singleShot: it keeps what it has called, and with it the whole window.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self.settle)

    @abstractmethod
    def widths(self) -> Sequence[int]:
        """Return the widths it may have now, px, the best first."""

    @abstractmethod
    def laid_out(self, width: int) -> QSize:
        """Lay out what is inside for a width; return the size that takes."""

    def appear(self) -> None:
        """Show it where there is room now, and again once all else there has its place."""
        for one in self._over.findChildren(QWidget, options=_DIRECT):
            if one is not self:
                one.installEventFilter(self)  # once, however often it is asked for
        self.show()
        self._place()
        # The view may still be on its way to what was opened.
        self._soon.start()

    def settle(self) -> None:
        """Go out of the way of what it covers now: the form, the hint, a bar."""
        if self.isVisible():
            covers = covered(self.geometry(), self._others(), self._form())
            # Two that evade each other come to rest: whichever moves covers less than before.
            if covers > 0:
                self._place(covers)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when the viewport changes its size, and out of the way of others there."""
        if self.isVisible():
            if watched is self._over and event.type() == QEvent.Type.Resize:
                self._place()
                self._soon.start()
            elif watched is not self._over and event.type() in _MOVES:
                self._soon.start()
        return super().eventFilter(watched, event)

    def _others(self) -> list[QRect]:
        return [one.geometry() for one in beside(self)]

    def _place(self, most: float = np.inf) -> None:
        """Lie where least is covered, if that is less than `most`."""
        others, form, width = self._others(), self._form(), self.width()
        widths = self.widths()
        sizes = [self.laid_out(one) for one in widths]
        which, corner = free_place(self._over.size(), sizes, others, form)
        if covered(QRect(corner, sizes[which]), others, form) >= most:
            self.laid_out(width)
            return
        self.resize(self.laid_out(widths[which]))
        self.move(corner)
        self.raise_()
