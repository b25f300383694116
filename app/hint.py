"""The hint line: one sentence in the viewport that says what to do next, or what went wrong."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QWidget

from app.look import ERROR, Theme, icon

MARGIN = 16
WIDEST = 760
NOTICE_SECONDS = 6.0


class HintLine(QFrame):
    """A quiet plate near the lower edge of the viewport.

    A problem goes before a tool's own words, those before a notice, and that before the hint.
    """

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self._over = over
        self.setObjectName("hint")
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAccessibleName("What to do next")
        self._sign = QLabel(self)
        self._sign.setFixedSize(20, 20)
        self._text = QLabel(self)
        # A file's name may look like markup.
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setWordWrap(False)
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 8, 16, 8)
        row.setSpacing(8)
        row.addWidget(self._sign, 0, Qt.AlignmentFlag.AlignTop)
        row.addWidget(self._text, 1)
        self._theme: Theme | None = None
        self._looks: tuple[Theme, str, str] | None = None
        self.problem = self.said = self.notice = self.hint = ""
        self._done = True
        self._fade = QTimer(self)
        self._fade.setSingleShot(True)
        self._fade.timeout.connect(lambda: self.set_notice(""))
        over.installEventFilter(self)

    @property
    def text(self) -> str:
        """The sentence that is shown."""
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

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in place when the viewport changes its size."""
        if event.type() == QEvent.Type.Resize:
            self._place()
        return super().eventFilter(watched, event)

    def _show(self) -> None:
        theme, text = self._theme, self.text
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
            f"#hint QLabel {{ color: {front}; background: transparent; }}"
        )
        self._text.setText(text)
        self._place()

    def _place(self) -> None:
        over = self._over
        most = min(WIDEST, over.width() - 2 * MARGIN)
        self._text.setWordWrap(False)
        wide = self._text.sizeHint().width() + 60
        if wide > most:
            self._text.setWordWrap(True)
            self._text.setFixedWidth(max(most - 60, 120))
        else:
            self._text.setMinimumWidth(0)
            self._text.setMaximumWidth(16777215)
        self.adjustSize()
        self.move((over.width() - self.width()) // 2, over.height() - self.height() - MARGIN)
        self.raise_()
