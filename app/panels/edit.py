"""Edit panel: the strokes of the edit being prepared, and how it is solved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSlider,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.key_words import Read, plain
from app.look import PIN, SOURCE, TARGET, Theme, icon
from app.panels.decimal_field import DecimalField
from app.panels.panel import GRID, Choice, Panel, plain_number
from app.session import Session
from app.symmetry import Symmetry
from engine import Draft, EditOptions, Source, Stroke

CURVE = "mdi6.vector-curve"

SYMMETRIES = (
    ("Off", "off"),
    ("Found on the model", "found"),
    ("X, through the middle", "x"),
    ("Y, through the middle", "y"),
    ("Z, through the middle", "z"),
)


class EditPanel(Panel):
    """What the edit is made of, the amount, how depth and rim are treated, and Apply.

    Signals
    -------
    apply_asked : the Apply button was pressed.
    plane_pointed(on) : the pointer came to the choice of the plane of symmetry, or left it.
    """

    apply_asked = Signal()
    plane_pointed = Signal(bool)

    def __init__(self, session: Session, plane: Symmetry, parent: QWidget | None = None) -> None:
        super().__init__("Edit", parent)
        self._session = session
        self._plane = plane
        self._listed: tuple[object, ...] = ()
        self._strokes = QVBoxLayout()
        self._strokes.setSpacing(GRID // 2)
        self.amount = QSlider(Qt.Orientation.Horizontal, self)
        self.amount.setRange(0, 150)
        self.amount.setAccessibleName("Amount")
        self.amount.setToolTip("How far the form goes towards the target")
        self._amount_words = QLabel(self)
        self._amount_words.setMinimumWidth(44)
        self._amount_words.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.depth_hold = DecimalField(self)
        self.depth_hold.setRange(0.0, 10.0)
        self.depth_hold.setDecimals(3)
        self.depth_hold.setSingleStep(0.01)
        self.depth_hold.setToolTip("How firmly the curve keeps its distance from the eye")
        self.polish = QSpinBox(self)
        self.polish.setRange(0, 50)
        self.polish.setSpecialValueText("off")
        self.polish.setSuffix(" rounds")
        self.polish.setToolTip("As-rigid-as-possible rounds: less stretch at large bends")
        self.rim = Choice(self)
        self.rim.addItem("Smooth", "smooth")
        self.rim.addItem("As in the paper", "paper")
        self.rim.setToolTip("How the base shape meets the part that stays")
        self.symmetry = Choice(self)
        for words, which in SYMMETRIES:
            self.symmetry.addItem(words, which)
        self.symmetry.installEventFilter(self)
        self.symmetry.setToolTip("Region and curves get a twin on the other side of this plane")
        self.rectify = QCheckBox("Details turn with the form", self)
        self.rectify.setToolTip("Off: details keep their direction in space (Fig. 11)")
        self.apply = QPushButton("Apply", self)
        self.apply.setMinimumHeight(32)
        self.apply.clicked.connect(self.apply_asked)
        grid = QGridLayout()
        grid.setHorizontalSpacing(GRID)
        grid.setVerticalSpacing(GRID // 2)
        amount = QHBoxLayout()
        amount.addWidget(self.amount, 1)
        amount.addWidget(self._amount_words)
        simple = QHBoxLayout()
        simple.setSpacing(GRID)
        simple.addWidget(QLabel("Amount", self))
        simple.addLayout(amount, 1)
        for row, (label, widget) in enumerate(
            (
                ("Symmetry", self.symmetry),
                ("Depth hold", self.depth_hold),
                ("Polish", self.polish),
                ("Rim", self.rim),
            )
        ):
            widget.setMinimumHeight(32)
            widget.setAccessibleName(label)
            if isinstance(widget, QAbstractSpinBox):
                plain_number(widget)
            grid.addWidget(QLabel(label, self), row, 0)
            grid.addWidget(widget, row, 1)
        grid.setColumnStretch(1, 1)
        self.body.addLayout(self._strokes)
        grid.addWidget(self.rectify, 4, 0, 1, 2)
        self._more = Panel("More options", self, opened=False)
        self._more.body.setContentsMargins(0, 0, 0, 0)
        self._more.body.addLayout(grid)
        self.body.addLayout(simple)
        self.body.addWidget(self.apply)
        self.body.addWidget(self._more)
        self.amount.valueChanged.connect(lambda v: self._set(lambda o: replace(o, amount=v / 100)))
        self.depth_hold.valueChanged.connect(
            lambda v: self._set(lambda o: replace(o, depth_hold=v))
        )
        self.polish.valueChanged.connect(lambda v: self._set(lambda o: replace(o, polish=v)))
        self.rim.activated.connect(
            lambda _i: self._set(lambda o: replace(o, rim=self.rim.currentData()))
        )
        self.symmetry.activated.connect(self._symmetry_chosen)
        self.rectify.toggled.connect(lambda on: self._set(lambda o: replace(o, rectify=on)))
        session.document_changed.connect(self._keep_up)
        session.busy_changed.connect(self._keep_up)
        self.refresh()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Say when the pointer is at the choice of the plane."""
        if watched is self.symmetry and event.type() in (QEvent.Type.Enter, QEvent.Type.Leave):
            self.plane_pointed.emit(event.type() == QEvent.Type.Enter)
        return super().eventFilter(watched, event)

    def name_keys(self, read: Read) -> None:
        """Say the key that applies the edit, as `read` knows it."""
        self.apply.setToolTip(plain("Put the details back and keep the edit ({edit.apply})", read))

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        super().dress(theme)
        self._more.dress(theme)
        self.refresh()

    def _symmetry_chosen(self) -> None:
        self._plane.choose(self.symmetry.currentData())

    def _set(self, change: Callable[[EditOptions], EditOptions]) -> None:
        document = self._session.document
        if document is not None:
            self._session.set_options(change(document.draft.options))

    def _keep_up(self) -> None:
        self._session.turn.once(self.refresh)

    def refresh(self) -> None:
        """Show the draft of the current document."""
        document = self._session.document
        options = EditOptions() if document is None else document.draft.options
        widgets = (self.amount, self.depth_hold, self.polish, self.rim, self.rectify)
        for widget in widgets:
            widget.setEnabled(document is not None and document.draft.roi is not None)
        self.symmetry.setEnabled(document is not None)
        self.symmetry.setCurrentIndex(self.symmetry.findData(self._plane.which))
        blockers = [QSignalBlocker(widget) for widget in widgets]
        self.amount.setValue(round(options.amount * 100))
        self._amount_words.setText(f"{options.amount:.0%}".replace("%", " %"))
        self.depth_hold.setValue(options.depth_hold)
        self.polish.setValue(options.polish)
        self.rim.setCurrentIndex(max(self.rim.findData(options.rim), 0))
        self.rectify.setChecked(options.rectify)
        del blockers
        self.apply.setText("Applying…" if self._session.applying else "Apply")
        self._list_strokes()

    def set_ready(self, ready: bool) -> None:
        """Say whether Apply has something to do."""
        self.apply.setEnabled(ready)

    def _list_strokes(self) -> None:
        document, theme = self._session.document, self._theme
        if document is None or theme is None:
            return
        wanted = (theme, *_lines(document.draft))
        if wanted == self._listed:
            return  # buttons made anew would lose a press that is on its way
        self._listed = wanted
        while (item := self._strokes.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        for line in _lines(document.draft):
            self._strokes.addWidget(self._row(line, theme))

    def _row(self, line: Line, theme: Theme) -> QWidget:
        row = QWidget(self)
        across = QHBoxLayout(row)
        across.setContentsMargins(0, 0, 0, 0)
        sign = QLabel(row)
        colour = theme.faint if line.hidden else line.colour
        sign.setPixmap(icon(line.icon, theme, colour).pixmap(16, 16))
        label = QLabel(line.words, row)
        if line.hidden:
            label.setStyleSheet(f"color: {theme.faint};")
        bin_ = QToolButton(row)
        bin_.setIcon(icon("mdi6.delete-outline", theme))
        bin_.setToolTip(f"Remove {line.name}")
        bin_.setAccessibleName(bin_.toolTip())
        bin_.clicked.connect(lambda: self._remove(line.which))
        across.addWidget(sign)
        across.addWidget(label, 1)
        if isinstance(line.which, int):
            across.addWidget(self._eye(row, line.name, theme, line.which, line.hidden))
        across.addWidget(bin_)
        return row

    def _eye(self, row: QWidget, name: str, theme: Theme, which: int, hidden: bool) -> QToolButton:
        eye = QToolButton(row)
        eye.setIcon(icon("mdi6.eye-off-outline" if hidden else "mdi6.eye-outline", theme))
        eye.setToolTip(f"Let {name} act again" if hidden else f"Put {name} aside")
        eye.setAccessibleName(eye.toolTip())
        eye.clicked.connect(lambda: self._hide(which, not hidden))
        return eye

    def _hide(self, which: int, hidden: bool) -> None:
        document = self._session.document
        if document is None:
            return
        strokes = list(document.draft.strokes)
        strokes[which] = replace(strokes[which], hidden=hidden)
        draft = replace(document.draft, strokes=tuple(strokes))
        label = "Curve put aside" if hidden else "Curve acts again"
        self._session.change(document.with_draft(draft), label)

    def _remove(self, which: int | Literal["source", "pins"]) -> None:
        document = self._session.document
        if document is None:
            return
        draft, label = document.draft, "Curve removed"
        if which == "source":
            draft = replace(draft, source=None)
        elif which == "pins":
            draft, label = replace(draft, options=replace(draft.options, pins=())), "Pins removed"
        else:
            draft = replace(draft, strokes=draft.strokes[:which] + draft.strokes[which + 1 :])
        self._session.change(document.with_draft(draft), label)


@dataclass(frozen=True)
class Line:
    """One line of the list: a stroke by its number, the waiting source, or the pins."""

    which: int | Literal["source", "pins"]
    name: str
    words: str
    icon: str
    colour: str
    hidden: bool = False


def _lines(draft: Draft) -> list[Line]:
    """Return what the edit is made of, as lines of the list."""
    made: list[Line] = []
    for i, stroke in enumerate(draft.strokes):
        words = _of("Curve", i + 1, stroke)
        made.append(Line(i, f"curve {i + 1}", words, CURVE, TARGET, stroke.hidden))
    if draft.source is not None:
        made.append(Line("source", "source", _of("Source", None, draft.source), CURVE, SOURCE))
    pins = np.array(draft.options.pins, dtype=np.int64)
    count = 0 if draft.roi is None else int(np.isin(pins, draft.roi, kind="table").sum())
    if count:
        words = "1 pin" if count == 1 else f"{count} pins"
        made.append(Line("pins", words, words, "mdi6.pin-outline", PIN))
    return made


def _of(name: str, number: int | None, curve: Stroke | Source) -> str:
    numbered = name if number is None else f"{name} {number}"
    closed = "closed, " if curve.closed else ""
    return f"{numbered}, {closed}{len(curve.anchors)} anchors"
