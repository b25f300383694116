"""Panel: a titled part of the right column that collapses."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QPointF, QSettings, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPalette, QPen, QPolygonF
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.look import Theme, icon

GRID = 8  # px; all spacings are multiples of it or its half
# Arrows, wheel and typing change a number; the tiny buttons are no target for a pen.
_NUMBER = (
    "QAbstractSpinBox::up-button, QAbstractSpinBox::down-button"
    " { width: 0px; border: none; background: transparent; }"
    "QAbstractSpinBox::up-arrow, QAbstractSpinBox::down-arrow { width: 0px; height: 0px; }"
    "QLineEdit { border: none; background: transparent; padding: 0px; min-height: 0px; }"
)
_CHOICE = (
    "QComboBox::drop-down { border: none; background: transparent; width: 24px; }"
    "QComboBox::down-arrow { image: none; }"
    "QComboBox { padding-right: 20px; }"
)


class Panel(QWidget):
    """A title that folds, and a body below it."""

    def __init__(self, title: str, parent: QWidget | None = None, opened: bool = True) -> None:
        super().__init__(parent)
        self.setObjectName(f"panel {title}")
        self._theme: Theme | None = None
        self._key = f"panels/{title}/open"
        self._head = QToolButton(self)
        self._head.setText(title)
        self._head.setCheckable(True)
        self._head.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._head.setStyleSheet(
            "QToolButton { font-weight: 600; padding: 4px 6px; text-align: left; border: 0; }"
            "QToolButton:checked { background: transparent; color: palette(window-text); }"
        )
        self._note = QLabel(self)
        self._note.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        head = QHBoxLayout()
        head.setContentsMargins(0, 0, GRID, 0)
        head.addWidget(self._head)
        head.addWidget(self._note, 1)
        self.body = QVBoxLayout()
        self._inside = QWidget(self)
        self._inside.setLayout(self.body)
        self.body.setContentsMargins(GRID * 2, 0, GRID * 2, GRID)
        self.body.setSpacing(GRID)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, GRID // 2, 0, 0)
        column.setSpacing(0)
        column.addLayout(head)
        column.addWidget(self._inside)
        opened = bool(QSettings().value(self._key, opened, type=bool))
        self._head.setChecked(opened)
        self._fold(opened)
        self._head.toggled.connect(self._toggled)

    def unfold(self) -> None:
        """Show what is below the title."""
        self._head.setChecked(True)

    def set_note(self, text: str) -> None:
        """Show a short text beside the title, visible even when folded."""
        self._note.setText(text)

    def set_low(self, on: bool) -> None:
        """Take less height where there is little; a panel that cannot stays as it is."""

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self._theme = theme
        self._note.setStyleSheet(f"color: {theme.faint};")
        self._fold(self._head.isChecked())

    def _toggled(self, opened: bool) -> None:
        QSettings().setValue(self._key, opened)
        self._fold(opened)

    def _fold(self, opened: bool) -> None:
        self._inside.setVisible(opened)
        if self._theme is not None:
            name = "mdi6.chevron-down" if opened else "mdi6.chevron-right"
            self._head.setIcon(icon(name, self._theme, self._theme.faint))


class Choice(QComboBox):
    """A choice with a quiet chevron instead of the style's button."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setStyleSheet(_CHOICE)
        self.setMinimumHeight(32)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the chevron over the plain field, in the colour of its text."""
        super().paintEvent(event)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        group = QPalette.ColorGroup.Active if self.isEnabled() else QPalette.ColorGroup.Disabled
        painter.setPen(QPen(self.palette().color(group, QPalette.ColorRole.Text), 1.4))
        middle = QPointF(self.width() - 14.0, self.height() / 2 + 0.5)
        corners = (QPointF(-4.0, -2.0), QPointF(0.0, 2.0), QPointF(4.0, -2.0))
        painter.drawPolyline(QPolygonF([middle + one for one in corners]))
        painter.end()


class _TakesEnter(QObject):
    """Enter takes a number that was typed, Esc the one before; else both are the window's."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep the keys from the shortcuts while the text is not the value yet."""
        kinds = (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress)
        if event.type() not in kinds or not isinstance(event, QKeyEvent):
            return False
        if not isinstance(watched, QSpinBox | QDoubleSpinBox) or not _typed(watched):
            return False
        leaves = event.key() == Qt.Key.Key_Escape
        if event.type() == QEvent.Type.ShortcutOverride:
            taken = leaves or event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
            if taken:
                event.accept()
            return taken
        if leaves:
            watched.lineEdit().setText(_shown(watched))
            watched.selectAll()
        return leaves


def _own_text(box: QSpinBox) -> str:
    """Return the text of the value of a field for whole numbers."""
    return box.textFromValue(box.value())


def _shown(box: QSpinBox | QDoubleSpinBox) -> str:
    """Return the text that a field shows for its value."""
    own = _own_text(box) if isinstance(box, QSpinBox) else box.textFromValue(box.value())
    special = box.specialValueText() if box.value() == box.minimum() else ""
    return special or f"{box.prefix()}{own}{box.suffix()}"


def _typed(box: QSpinBox | QDoubleSpinBox) -> bool:
    return box.text() != _shown(box)


def plain_number(box: QAbstractSpinBox) -> None:
    """Make a number field plain: typing, arrows and wheel, no tiny buttons."""
    box.setStyleSheet(_NUMBER)
    box.setMinimumSize(72, 32)  # not as wide as the largest number it could hold
    box.setKeyboardTracking(False)
    box.lineEdit().setTextMargins(8, 0, 8, 0)
    box.installEventFilter(_TakesEnter(box))
