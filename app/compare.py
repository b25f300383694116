"""Compare: another moment of the history beside the current one, seen from the same place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSlider,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.look import Theme
from app.overlying import Overlying
from app.panels.panel import GRID, plain_number
from app.panels.shelf import Shelf
from app.session import Session
from app.viewport import Viewport
from app.viewport.heavy import is_heavy, prepare
from engine import Document, EngineError, Mesh, Moment
from engine.morph import FORM_MODES
from plugins.morph import MOST_MODES, MorphStep, morph_between

MARGIN = 12
SLIDES = 100
SHOWING, BETWEEN = "compare", "between"  # channels of the engine's thread
ROOM_FOR_CUBE = 360  # px, beside the words and the buttons
HEIGHT = 44  # of the bar, as of the one above the form


class Header(Overlying):
    """Words, and buttons if there are any, at the upper left of a viewport."""

    def __init__(self, over: QWidget) -> None:
        super().__init__(over, "header")
        self._text = ""
        self._words = QLabel(self)
        self._words.setStyleSheet("font-weight: 600;")
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(12, 6, 12, 6)
        self._row.setSpacing(8)
        self._row.addWidget(self._words)
        self.move(MARGIN, MARGIN)

    def add(self, words: str, tip: str, clicked: Callable[[], object]) -> None:
        """Put a button behind the words."""
        button = QPushButton(words, self)
        button.setToolTip(tip)
        button.clicked.connect(lambda _on=False: clicked())
        self._row.addWidget(button)

    def say(self, text: str) -> None:
        """Show `text`, or nothing."""
        self._text = text
        self.setVisible(bool(text))
        self._fit()
        self.raise_()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Shorten the words where there is too little room, not the buttons."""
        if event.type() == QEvent.Type.Resize:
            self._fit()
        return super().eventFilter(watched, event)

    def _fit(self) -> None:
        self._words.setText("")
        room = self._over.width() - 2 * MARGIN - self.sizeHint().width()
        elided = Qt.TextElideMode.ElideRight
        measure = self._words.fontMetrics()
        self._words.setText(measure.elidedText(self._text, elided, max(room, 0)))
        self._words.setToolTip(self._text)
        self.adjustSize()


class MorphBar(QFrame):
    """Two sliders below the two forms: how much of the other form and of its detail is wanted.

    Signals
    -------
    moved : a slider was moved.
    kept : what is shown shall become a step.
    """

    moved = Signal()
    kept = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Morph")
        title = QLabel("Morph", self)
        title.setStyleSheet("font-weight: 600;")
        self._reason = QLabel(self)
        self._reason.setWordWrap(True)
        self._reason.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._words: list[tuple[QSlider, QLabel]] = []
        self._controls = QWidget(self)
        self._row = QHBoxLayout(self._controls)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(GRID)
        self.form = self._slider(
            "Form", "How much of the form on the right the one on the left takes on"
        )
        self.detail = self._slider("Detail", "How much of the detail on the right it takes on")
        self.modes = QSpinBox(self)
        self.modes.setRange(1, MOST_MODES)
        self.modes.setValue(FORM_MODES)
        self.modes.setSuffix(" modes")
        self.modes.setToolTip("With more of them finer features count as form; the rest is detail")
        self.modes.setAccessibleName("What counts as form")
        plain_number(self.modes)
        self.modes.valueChanged.connect(lambda _value: self._show_moved())
        self._row.addWidget(QLabel("Form ends at", self))
        self._row.addWidget(self.modes)
        self._row.addStretch(1)
        self.keep = QPushButton("Keep", self)
        self.keep.setToolTip("Make what you see on the left a step")
        self.keep.clicked.connect(lambda _on=False: self.kept.emit())
        self._row.addWidget(self.keep)
        row = QHBoxLayout(self)
        row.setContentsMargins(2 * GRID, GRID // 2, 2 * GRID, GRID // 2)
        row.setSpacing(2 * GRID)
        row.addWidget(title)
        row.addWidget(self._reason, 1)
        self.shelf = Shelf(self._controls, self)
        row.addWidget(self.shelf, 1)
        self.setFixedHeight(HEIGHT)
        self.clear()

    @property
    def shares(self) -> tuple[float, float]:
        """Form and detail, 0 to 1."""
        return self.form.value() / SLIDES, self.detail.value() / SLIDES

    def offer(self, reason: str = "") -> None:
        """Let the person morph, or say why nothing lies between the two."""
        self.clear()
        self._reason.setText(reason)
        self._reason.setVisible(bool(reason))
        self.shelf.setVisible(not reason)

    def clear(self) -> None:
        """Put both sliders at this variant, without a signal."""
        for slider in (self.form, self.detail):
            with QSignalBlocker(slider):
                slider.setValue(0)
        self._read()

    def _read(self) -> None:
        """Say the shares beside the sliders; nothing can be kept while both are nothing."""
        for slider, words in self._words:
            words.setText(f"{slider.value()} %")
        self.keep.setEnabled(self.shares != (0.0, 0.0))

    def _show_moved(self) -> None:
        self._read()
        self.moved.emit()

    def _slider(self, words: str, tip: str) -> QSlider:
        slider = QSlider(Qt.Orientation.Horizontal, self)
        slider.setRange(0, SLIDES)
        slider.setMinimumWidth(24)
        slider.setMaximumWidth(240)
        slider.setMinimumHeight(32)
        slider.setToolTip(tip)
        slider.setAccessibleName(words)
        slider.valueChanged.connect(lambda _value: self._show_moved())
        share = QLabel(self)
        share.setFixedWidth(share.fontMetrics().horizontalAdvance("100 %") + 2)
        share.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._words.append((slider, share))
        self._row.addWidget(QLabel(words, self))
        self._row.addWidget(slider, 4)
        self._row.addWidget(share)
        self._row.addSpacing(GRID)
        return slider


class Compare(QWidget):
    """The second viewport with its own bar; made when it is wanted and closed with it.

    Attributes
    ----------
    morph : the sliders between the two; whoever shows this puts them below both.

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
        self.morph = MorphBar(self)
        self.morph.moved.connect(self._preview)
        self.morph.kept.connect(self._keep)
        self.morph.shelf.dress(theme)
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

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show one cube for both where there is no room for two."""
        super().resizeEvent(event)
        self.viewport.cube.setVisible(self.width() >= ROOM_FOR_CUBE)

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        self.viewport.set_theme(theme)
        self.morph.shelf.dress(theme)

    def show_moment(self, moment: Moment) -> None:
        """Show a moment beside the current one."""
        # Until it looks from where the main one does, it does not lead that anywhere.
        self.moment = None
        self.header.say(moment.name or moment.label)
        mesh = moment.document.mesh
        if is_heavy(mesh):
            self._session.jobs.submit(
                SHOWING,
                lambda _run: prepare(mesh),
                lambda _none: self._show(moment),
                self._session.problems.report,
                priority=1,
                urgent=True,
            )
        else:
            self._show(moment)

    def _show(self, moment: Moment) -> None:
        """Show a moment whose mesh needs no more than a moment."""
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
        for channel in (SHOWING, BETWEEN):
            self._session.jobs.cancel(channel)
        self._session.document_changed.disconnect(self._follow)
        self._main.camera_changed.disconnect(self._look)
        self._main.looks_changed.disconnect(self._take_looks)
        self._session.end_preview()
        self.main_header.say("")
        self.main_header.deleteLater()
        self.morph.setParent(None)
        self.morph.deleteLater()
        self.viewport.close()

    def _take_looks(self) -> None:
        """Colour both in the same way."""
        if self.moment is not None:
            self.viewport.set_stripes(self._main.stripes)
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
        self._mark_region()
        self._offer_morph()

    def _mark_region(self) -> None:
        """Tint the region on both: what is coloured on one side only seems to be another form."""
        document = self._session.document
        if document is None or self.moment is None:
            return
        alike = self.moment.document.mesh.faces is document.mesh.faces
        self.viewport.set_region(document.draft.roi if alike else None)

    # ---- between the two

    def _offer_morph(self) -> None:
        """Let the two be morphed when something lies between them, from the current one on."""
        document = self._session.document
        if document is None or self.moment is None or document is self._of:
            return
        self._of = document
        here, there = document.mesh, self.moment.document.mesh
        self._session.jobs.cancel(BETWEEN)
        if is_heavy(here):
            self._step = None
            self._session.jobs.submit(
                BETWEEN,
                lambda _run: _between(here, there),
                lambda found: self._offer(*found),
                self._session.problems.report,
                priority=1,
                urgent=True,
            )
        else:
            self._offer(*_between(here, there))

    def _offer(self, step: MorphStep | None, reason: str) -> None:
        """Let the two be morphed by a step, or say why not."""
        self._step = step
        held = QApplication.focusWidget()
        if reason and held is not None and self.morph.isAncestorOf(held):
            self._main.setFocus()  # else the keys would go to whatever comes next
        self.morph.offer(reason)

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
            self._main.setFocus()  # the button has nothing more to keep
            self._session.apply(wanted)


def _between(here: Mesh, there: Mesh) -> tuple[MorphStep | None, str]:
    """Return the step that morphs one mesh into another, or none and why nothing lies between."""
    try:
        return morph_between(here, there), ""
    except EngineError as error:
        return None, str(error)
