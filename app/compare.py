"""Compare: another moment of the history beside the current one, seen from the same place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSlider,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.look import Theme
from app.panels.panel import plain_number
from app.session import Session
from app.viewport import Viewport
from engine import Document, EngineError, Moment
from engine.morph import FORM_MODES
from plugins.morph import MOST_MODES, MorphStep, morph_between

MARGIN = 12
SLIDES = 100


class Header(QFrame):
    """Words, and buttons if there are any, at the upper left of a viewport."""

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self.setObjectName("header")
        self.setStyleSheet(
            "#header { background: palette(window); border: 1px solid palette(mid);"
            " border-radius: 8px; }"
        )
        self._words = QLabel(self)
        self._words.setStyleSheet("font-weight: 600;")
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(12, 6, 12, 6)
        self._column.setSpacing(4)
        self._row = QHBoxLayout()
        self._row.setSpacing(8)
        self._row.addWidget(self._words)
        self._column.addLayout(self._row)
        self.move(MARGIN, MARGIN)
        self.hide()

    def add(self, words: str, tip: str, clicked: Callable[[], object]) -> None:
        """Put a button behind the words."""
        button = QPushButton(words, self)
        button.setToolTip(tip)
        button.clicked.connect(lambda _on=False: clicked())
        self._row.addWidget(button)

    def say(self, text: str) -> None:
        """Show `text`, or nothing."""
        self._words.setText(text)
        self.setVisible(bool(text))
        self.adjustSize()
        self.raise_()


class MorphBar(Header):
    """Two sliders at the lower left: how much of the other form and of its detail is wanted.

    Signals
    -------
    moved : a slider was moved.
    kept : what is shown shall become a step.
    """

    moved = Signal()
    kept = Signal()

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self.form = self._slider("Form", "How much of this variant's form the current one takes on")
        self.detail = self._slider("Detail", "How much of this variant's detail it takes on")
        self.add("Keep", "Make what you see a step", self.kept.emit)
        self.modes = QSpinBox(self)
        self.modes.setRange(1, MOST_MODES)
        self.modes.setValue(FORM_MODES)
        self.modes.setSuffix(" modes")
        self.modes.setToolTip("With more of them finer features count as form; the rest is detail")
        self.modes.setAccessibleName("What counts as form")
        plain_number(self.modes)
        self.modes.valueChanged.connect(lambda _value: self.moved.emit())
        below = QHBoxLayout()
        below.setSpacing(8)
        below.addWidget(QLabel("What counts as form", self))
        below.addWidget(self.modes)
        below.addStretch(1)
        self._column.addLayout(below)
        self.clear()

    @property
    def shares(self) -> tuple[float, float]:
        """Form and detail, 0 to 1."""
        return self.form.value() / SLIDES, self.detail.value() / SLIDES

    def clear(self) -> None:
        """Put both sliders at this variant, without a signal."""
        for slider in (self.form, self.detail):
            with QSignalBlocker(slider):
                slider.setValue(0)

    def _slider(self, words: str, tip: str) -> QSlider:
        self._row.addWidget(QLabel(words, self))
        slider = QSlider(Qt.Orientation.Horizontal, self)
        slider.setRange(0, SLIDES)
        slider.setFixedWidth(72)
        slider.setMinimumHeight(32)
        slider.setToolTip(tip)
        slider.setAccessibleName(words)
        slider.valueChanged.connect(lambda _value: self.moved.emit())
        self._row.addWidget(slider)
        return slider


class Compare(QWidget):
    """The second viewport with its own bar; made when it is wanted and closed with it.

    Signals
    -------
    closed : the person has seen enough.
    """

    closed = Signal()

    def __init__(self, session: Session, main: Viewport, theme: Theme, parent: QWidget) -> None:
        super().__init__(parent)
        self._session = session
        self._main = main
        self.moment: Moment | None = None
        self._linking = False
        self.viewport = Viewport(self, theme)
        self.header = Header(self.viewport)
        self.header.add("Swap", "Go to this step; the current one comes here", self.swap)
        self.header.add("Close", "Close the comparison", self.closed.emit)
        self.main_header = Header(main)
        self.morph = MorphBar(self.viewport)
        self.morph.moved.connect(self._preview)
        self.morph.kept.connect(self._keep)
        self._step: MorphStep | None = None
        self._of: Document | None = None
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.viewport)
        session.document_changed.connect(self._follow)
        # Both look from the same place; `look_as` changes nothing when they already do.
        main.camera_changed.connect(self._look)
        self.viewport.camera_changed.connect(self._lead)
        main.looks_changed.connect(self._take_looks)

    def show_moment(self, moment: Moment) -> None:
        """Show a moment beside the current one."""
        # Until it looks from where the main one does, it does not lead that anywhere.
        self.moment = None
        self.header.say(moment.name or moment.label)
        self._of = None
        self.viewport.set_mesh(moment.document.mesh)
        self.viewport.set_unit(moment.document.unit)
        self.viewport.set_reference(moment.document.original.vertices)
        self.viewport.look_as(self._main)
        self.moment = moment
        self._take_looks()
        self._follow()

    def swap(self) -> None:
        """Put each on the other's side."""
        history, before = self._session.history, self._session.moment
        if history is None or before is None or self.moment is None:
            return
        there = self.moment
        self._session.go(there.id)
        self.show_moment(before)

    def end(self) -> None:
        """Free the second viewport; call it before the widget goes."""
        self._session.document_changed.disconnect(self._follow)
        self._main.camera_changed.disconnect(self._look)
        self._main.looks_changed.disconnect(self._take_looks)
        self._session.end_preview()
        self.main_header.say("")
        self.main_header.deleteLater()
        self.viewport.close()

    def _take_looks(self) -> None:
        """Colour both in the same way."""
        if self.moment is not None:
            self.viewport.set_display(self._main.display)
            self.viewport.set_wireframe(self._main.wireframe)

    def _look(self) -> None:
        self._linked(self.viewport, self._main)

    def _lead(self) -> None:
        self._linked(self._main, self.viewport)

    def _linked(self, follower: Viewport, leader: Viewport) -> None:
        if not self._linking and self.moment is not None:
            self._linking = True
            follower.look_as(leader)
            self._linking = False

    def _follow(self) -> None:
        moment = self._session.moment
        self.main_header.say("" if moment is None else (moment.name or moment.label))
        self._offer_morph()

    # ---- between the two

    def _offer_morph(self) -> None:
        """Show the sliders when something lies between the two; they start at the current one."""
        document = self._session.document
        if document is None or self.moment is None or document is self._of:
            return
        self._of = document
        try:
            self._step = morph_between(document.mesh, self.moment.document.mesh)
        except EngineError:
            self._step = None
        self.morph.clear()
        self.morph.say("Morph" if self._step is not None else "")
        self._place_morph()

    def _place_morph(self) -> None:
        self.morph.move(MARGIN, self.viewport.height() - self.morph.height() - MARGIN)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """The sliders stay at the lower left."""
        super().resizeEvent(event)
        self._place_morph()

    def _wanted(self) -> MorphStep | None:
        form, detail = self.morph.shares
        if self._step is None:
            return None
        return replace(self._step, form=form, detail=detail, modes=self.morph.modes.value())

    def _preview(self) -> None:
        wanted = self._wanted()
        if wanted is None or self.morph.shares == (0.0, 0.0):
            self._session.end_preview()
        else:
            self._session.preview(wanted)

    def _keep(self) -> None:
        wanted = self._wanted()
        if wanted is not None and self.morph.shares != (0.0, 0.0):
            self._session.apply(wanted)
