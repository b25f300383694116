"""The hint line: one sentence in the viewport that says what to do next, or what went wrong."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QMouseEvent, QTabletEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QWidget

from app.key_words import Read, linked, plain
from app.link_text import LinkText
from app.look import ERROR, Theme, icon

MARGIN = 16
WIDEST = 760
NOTICE_SECONDS = 6.0
AROUND = 60  # px of the plate beside its words

_DOWN = (QEvent.Type.MouseButtonPress, QEvent.Type.TabletPress)
_UP = (QEvent.Type.MouseButtonRelease, QEvent.Type.TabletRelease)
_MOVED = (QEvent.Type.MouseMove, QEvent.Type.TabletMove)


class HintLine(QFrame):
    """A quiet plate near the lower edge of the viewport.

    A problem goes before a tool's own words, those before a notice, and that before the hint.
    Actions that a sentence names by their ids (see `key_words`) are shown by their keys and can be
    clicked; beside them the plate lets the hand through to the form.

    Signals
    -------
    asked(id) : an action that the sentence names was clicked.
    """

    asked = Signal(str)

    def __init__(self, over: QWidget, read: Read = lambda _id: "") -> None:
        super().__init__(over)
        self._over = over
        self.setObjectName("hint")
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAccessibleName("What to do next")
        self._sign = QLabel(self)
        self._sign.setFixedSize(20, 20)
        self._text = LinkText(self)
        self._over = over
        self._read = read
        self._pressed = ""
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 8, 16, 8)
        row.setSpacing(8)
        row.addWidget(self._sign, 0, Qt.AlignmentFlag.AlignTop)
        row.addWidget(self._text, 0, Qt.AlignmentFlag.AlignVCenter)
        self._theme: Theme | None = None
        self._looks: tuple[Theme, str, str] | None = None
        self.problem = self.said = self.notice = self.hint = ""
        self._done = True
        self._colours = "", ""
        self._fade = QTimer(self)
        self._fade.setSingleShot(True)
        self._fade.timeout.connect(lambda: self.set_notice(""))
        over.installEventFilter(self)

    @property
    def text(self) -> str:
        """The sentence that is shown, as it is read."""
        return plain(self._sentence, self._read)

    @property
    def _sentence(self) -> str:
        return self.problem or self.said or self.notice or self.hint

    def set_hint(self, text: str) -> None:
        """Say what to do next."""
        self.hint = text
        self._show()

    def set_said(self, text: str) -> None:
        """Show the tool's own words while its gesture lasts."""
        self.said = text
        self._show()

    def set_notice(self, text: str, done: bool = True) -> None:
        """Show for a few seconds that something is done, or why it is not."""
        self.notice, self._done = text, done
        if text:
            self._fade.start(int(NOTICE_SECONDS * 1000))
        self._show()

    def set_problem(self, text: str) -> None:
        """Show what went wrong, with the remedy, as long as it is true."""
        self.problem = text
        self._show()

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self._show()

    def reread(self) -> None:
        """Show the keys that actions have now."""
        self._looks = None
        self._show()

    def place_of(self, action: str) -> QPointF | None:
        """Return where an action that the sentence names is, in px over the form."""
        place = self._text.place_of(action) if self.isVisible() else None
        return None if place is None else QPointF(self._text.mapTo(self._over, place))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the hand on a named action, and stay in place when the viewport changes its size."""
        kind = event.type()
        if kind == QEvent.Type.Resize:
            self._place()
        elif kind in _DOWN + _UP + _MOVED and isinstance(event, QMouseEvent | QTabletEvent):
            return self._handled(event)
        return super().eventFilter(watched, event)

    def _handled(self, event: QMouseEvent | QTabletEvent) -> bool:
        """Press, hover or let go a named action; returns whether the event is done with."""
        held = bool(event.buttons())
        if event.type() in _MOVED and held and not self._pressed:
            return False  # a stroke or a turn of the view passes by
        link = self._link_at(event.position()) if self.isVisible() else ""
        if event.type() in _DOWN:
            left = event.button() == Qt.MouseButton.LeftButton
            self._pressed = link if left else ""
            return bool(self._pressed)
        self._text.point_at(link)
        if event.type() in _MOVED:
            return bool(self._pressed)
        pressed, self._pressed = self._pressed, ""
        if pressed and link == pressed:
            self.asked.emit(pressed)
        return bool(pressed)

    def _link_at(self, place: QPointF) -> str:
        inside = self._text.mapFrom(self._over, place)
        return self._text.link_at(inside) if self._text.rect().contains(inside.toPoint()) else ""

    def _show(self) -> None:
        theme, text = self._theme, self._sentence
        if theme is None:
            return
        self.setVisible(bool(text))
        if not text:
            return
        bad = bool(self.problem)
        back = ERROR if bad else theme.panel
        front = "#ffffff" if bad else theme.text
        edge = ERROR if bad else theme.border
        name = "mdi6.alert-circle-outline" if bad else "mdi6.lightbulb-on-outline"
        if not bad and self.notice and not self.said:
            name = "mdi6.check" if self._done else "mdi6.information-outline"
        if (theme, text, name) == self._looks:
            return
        # A gesture sets the same words several times over; styling them anew takes milliseconds.
        self._looks = (theme, text, name)
        self._sign.setPixmap(icon(name, theme, front if bad else theme.faint).pixmap(20, 20))
        self.setStyleSheet(
            f"#hint {{ background: {back}; border: 1px solid {edge}; border-radius: 8px; }}"
            "#hint QLabel { background: transparent; }"
        )
        self._colours = front, front if bad else theme.accent
        self.setAccessibleDescription(self.text)
        self._place()

    def _place(self) -> None:
        most = min(WIDEST, self._over.width() - 2 * MARGIN) - AROUND
        self._text.say(linked(self._sentence, self._read), *self._colours, most)
        self.adjustSize()
        over = self._over
        self.move((over.width() - self.width()) // 2, over.height() - self.height() - MARGIN)
        self.raise_()
