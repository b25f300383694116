"""Edit panel: the strokes of the edit being prepared, and how it is solved."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QDoubleSpinBox,
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

from app.look import SOURCE, TARGET, Theme, icon
from app.panels.panel import GRID, Choice, Panel, plain_number
from app.session import Session
from engine import EditOptions

SYMMETRIES = (
    ("Off", "off"),
    ("Found on the model", "found"),
    ("X, through the middle", "x"),
    ("Y, through the middle", "y"),
    ("Z, through the middle", "z"),
)


class EditPanel(Panel):
    """Strokes with a bin each, the amount, how depth and rim are treated, and Apply.

    Signals
    -------
    apply_asked : the Apply button was pressed.
    """

    apply_asked = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__("Edit", parent)
        self._session = session
        self._strokes = QVBoxLayout()
        self._strokes.setSpacing(GRID // 2)
        self.amount = QSlider(Qt.Orientation.Horizontal, self)
        self.amount.setRange(0, 150)
        self.amount.setAccessibleName("Amount")
        self.amount.setToolTip("How far the form goes towards the target")
        self._amount_words = QLabel(self)
        self._amount_words.setMinimumWidth(44)
        self._amount_words.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.depth = QDoubleSpinBox(self)
        self.depth.setRange(0.0, 10.0)
        self.depth.setDecimals(3)
        self.depth.setSingleStep(0.01)
        self.depth.setToolTip("How firmly the curve keeps its distance from the eye")
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
        self.symmetry.setToolTip("Region and curves get a twin on the other side of this plane")
        self.rectify = QCheckBox("Details turn with the form", self)
        self.rectify.setToolTip("Off: details keep their direction in space (Fig. 11)")
        self.apply = QPushButton("Apply", self)
        self.apply.setToolTip("Put the details back and keep the edit (Enter)")
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
                ("Depth hold", self.depth),
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
        self.amount.valueChanged.connect(lambda v: self._set(amount=v / 100))
        self.depth.valueChanged.connect(lambda v: self._set(depth_hold=v))
        self.polish.valueChanged.connect(lambda v: self._set(polish=v))
        self.rim.activated.connect(lambda _i: self._set(rim=self.rim.currentData()))
        self.symmetry.activated.connect(self._symmetry_chosen)
        self.rectify.toggled.connect(lambda on: self._set(rectify=on))
        session.document_changed.connect(self.refresh)
        session.busy_changed.connect(self.refresh)
        self.refresh()

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        super().dress(theme)
        self._more.dress(theme)
        self.refresh()

    def _symmetry_chosen(self) -> None:
        wanted = self.symmetry.currentData()
        if wanted in ("off", "found"):
            self._session.set_symmetry(wanted == "found")
        else:
            self._session.mirror_across(wanted)

    def _set(self, **changes: object) -> None:
        document = self._session.document
        if document is not None:
            self._session.set_options(replace(document.draft.options, **changes))  # type: ignore[arg-type]

    def refresh(self) -> None:
        """Show the draft of the current document."""
        document = self._session.document
        options = EditOptions() if document is None else document.draft.options
        widgets = (self.amount, self.depth, self.polish, self.rim, self.rectify)
        for widget in widgets:
            widget.setEnabled(document is not None and document.draft.roi is not None)
        self.symmetry.setEnabled(document is not None)
        self.symmetry.setCurrentIndex(self.symmetry.findData(self._session.symmetry))
        blockers = [QSignalBlocker(widget) for widget in widgets]
        self.amount.setValue(round(options.amount * 100))
        self._amount_words.setText(f"{options.amount:.0%}".replace("%", " %"))
        self.depth.setValue(options.depth_hold)
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
        while (item := self._strokes.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        document, theme = self._session.document, self._theme
        if document is None or theme is None:
            return
        draft = document.draft
        for i, stroke in enumerate(draft.strokes):
            words = f"Curve {i + 1}, {len(stroke.anchors)} anchors"
            self._strokes.addWidget(self._row(words, TARGET, theme, i, stroke.hidden))
        if draft.source is not None:
            words = f"Source, {len(draft.source.anchors)} anchors"
            self._strokes.addWidget(self._row(words, SOURCE, theme, None))

    def _row(
        self, words: str, colour: str, theme: Theme, which: int | None, hidden: bool = False
    ) -> QWidget:
        row = QWidget(self)
        line = QHBoxLayout(row)
        line.setContentsMargins(0, 0, 0, 0)
        sign = QLabel(row)
        sign.setPixmap(
            icon("mdi6.vector-curve", theme, theme.faint if hidden else colour).pixmap(16, 16)
        )
        label = QLabel(words, row)
        if hidden:
            label.setStyleSheet(f"color: {theme.faint};")
        bin_ = QToolButton(row)
        bin_.setIcon(icon("mdi6.delete-outline", theme))
        bin_.setToolTip(f"Remove {words.split(',')[0].lower()}")
        bin_.setAccessibleName(bin_.toolTip())
        bin_.clicked.connect(lambda: self._remove(which))
        line.addWidget(sign)
        line.addWidget(label, 1)
        if which is not None:
            line.addWidget(self._eye(row, words, theme, which, hidden))
        line.addWidget(bin_)
        return row

    def _eye(self, row: QWidget, words: str, theme: Theme, which: int, hidden: bool) -> QToolButton:
        eye = QToolButton(row)
        eye.setIcon(icon("mdi6.eye-off-outline" if hidden else "mdi6.eye-outline", theme))
        name = words.split(",")[0].lower()
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

    def _remove(self, which: int | None) -> None:
        document = self._session.document
        if document is None:
            return
        draft = document.draft
        if which is None:
            draft = replace(draft, source=None)
        else:
            draft = replace(draft, strokes=draft.strokes[:which] + draft.strokes[which + 1 :])
        self._session.change(document.with_draft(draft), "Curve removed")
