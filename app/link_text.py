"""Link text: lines of words in which some can be clicked."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF
from PySide6.QtGui import QAbstractTextDocumentLayout, QColor, QPainter, QPalette, QTextDocument
from PySide6.QtGui import QPaintEvent as Paint
from PySide6.QtWidgets import QWidget

NEAR = (0.0, -5.0, 5.0)  # px that a pen may be beside a link
NARROWEST = 120


class LinkText(QWidget):
    """Rich text that tells where its links are, which a label does not."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._words = QTextDocument(self)
        self._words.setDocumentMargin(0)
        self._front = self._lit = ""
        self._html = self._pointed = ""

    @property
    def text(self) -> str:
        """The words as they are read."""
        return self._words.toPlainText()

    def say(self, html: str, front: str, lit: str, most: int) -> None:
        """Show rich text, at most `most` px wide.

        Parameters
        ----------
        front, lit : colours of the words, and of the link that is pointed at.
        """
        self._html, self._front, self._lit = html, front, lit
        self._pointed = ""
        self._words.setDefaultFont(self.font())
        self._words.setTextWidth(-1)
        self._write()
        if self._words.idealWidth() > most:
            self._words.setTextWidth(max(most, NARROWEST))
        size = self._words.size()
        self.setFixedSize(math.ceil(self._words.idealWidth()), math.ceil(size.height()))
        self.update()

    def link_at(self, place: QPointF) -> str:
        """Return what the link at a point of this widget is, "" where there is none."""
        layout = self._words.documentLayout()
        for dy in NEAR:
            for dx in NEAR:
                link = layout.anchorAt(place + QPointF(dx, dy))
                if link:
                    return link
        return ""

    def place_of(self, link: str) -> QPointF | None:
        """Return a point in the middle of the first line of a link, None without it."""
        layout = self._words.documentLayout()
        for y in range(4, self.height(), 4):
            row = [x for x in range(self.width()) if layout.anchorAt(QPointF(x, y)) == link]
            if row:
                return QPointF((row[0] + row[-1]) / 2, y)
        return None

    def point_at(self, link: str) -> None:
        """Show that a link is under the hand; "" for none."""
        if link != self._pointed:
            self._pointed = link
            self._write()
            self.update()

    def paintEvent(self, event: Paint) -> None:
        """Draw the words."""
        painter = QPainter(self)
        context = QAbstractTextDocumentLayout.PaintContext()
        palette = QPalette(self.palette())
        palette.setColor(QPalette.ColorRole.Text, QColor(self._front))
        context.palette = palette
        self._words.documentLayout().draw(painter, context)

    def _write(self) -> None:
        self._words.setDefaultStyleSheet(f"a {{ color: {self._front}; }}")
        lit = f'<a style="color: {self._lit}" href="{self._pointed}">'
        self._words.setHtml(self._html.replace(f'<a href="{self._pointed}">', lit))
