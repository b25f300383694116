"""Level panel: how much detail of the region is shown and edited."""

from __future__ import annotations

import math

from PySide6.QtCore import QSignalBlocker, Qt, QTimer
from PySide6.QtWidgets import (
    QBoxLayout,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSlider,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.key_words import Read, plain
from app.look import Theme, icon
from app.modes import REACH, ModesViewer
from app.panels.charts import Histogram, LevelCurve
from app.panels.decimal_field import DecimalField, LengthField
from app.panels.panel import GRID, Panel, plain_number
from app.session import Session
from engine import Decomposition
from engine.figures import figure

TICKS = 1000
SWINGS = 100
FARTHEST = 0.2  # of the region's diagonal
CHART_MS = 40


class LevelPanel(Panel):
    """Slider from the base shape to the full detail, and what it means in modes and millimetres."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__("Level", parent)
        self._session = session
        self.slider = QSlider(Qt.Orientation.Horizontal, self)
        self.slider.setRange(0, TICKS)
        self.slider.setPageStep(TICKS // 10)
        self.slider.setSingleStep(TICKS // 100)
        self.slider.setAccessibleName("Level of detail")
        self.slider.valueChanged.connect(lambda tick: session.slide_level(tick / TICKS))
        self.percent = _number(" %", 0.0, 100.0, 1, "Level of detail")
        self.percent.setSingleStep(1.0)
        self.percent.valueChanged.connect(lambda value: session.slide_level(value / 100))
        self.feature = LengthField(self)
        self.feature.setAccessibleName("Smallest feature that is kept")
        plain_number(self.feature)
        self.feature.setSpecialValueText("none")
        self.feature.editingFinished.connect(self._feature_typed)
        self.feature_slider = QSlider(Qt.Orientation.Horizontal, self)
        self.feature_slider.setRange(0, TICKS)
        self.feature_slider.setPageStep(TICKS // 10)
        self.feature_slider.setSingleStep(TICKS // 100)
        self.feature_slider.setAccessibleName("Smallest feature, slid")
        self.feature_slider.setToolTip(
            "The smallest feature that is kept: to the right down to the finest.\n"
            "Each part of the way divides the length by the same factor."
        )
        self.feature_slider.valueChanged.connect(self._feature_slid)
        self.modes = QLabel(self)
        self.modes.setAccessibleName("Modes")
        self._ends: list[QLabel] = []
        figures = QGridLayout()
        figures.setHorizontalSpacing(GRID)
        figures.setVerticalSpacing(GRID // 2)
        figures.addWidget(QLabel("Level", self), 0, 0)
        figures.addWidget(self.percent, 0, 1, 1, 2)
        figures.addLayout(self._between("Base", self.slider, "Full"), 1, 0, 1, 3)
        figures.addWidget(QLabel("Smallest feature", self), 2, 0)
        figures.addWidget(self.feature, 2, 1, 1, 2)
        figures.addLayout(self._between("Large", self.feature_slider, "Fine"), 3, 0, 1, 3)
        figures.addWidget(QLabel("Modes", self), 4, 0)
        figures.addWidget(self.modes, 4, 1)
        figures.setColumnStretch(1, 1)
        self.histogram = Histogram(self)
        self.histogram.asked.connect(self._cutoff_dragged)
        self.curve = LevelCurve(self)
        self.curve.asked.connect(self._modes_asked)
        self.modes_button = QToolButton(self)
        self.modes_button.setCheckable(True)
        self.modes_button.setToolTip("See the shape of the modes on the form (Fig. 5)")
        self.modes_button.setAccessibleName("See the modes")
        self.modes_button.toggled.connect(self._modes_toggled)
        figures.addWidget(self.modes_button, 4, 2)
        self._viewer: ModesViewer | None = None
        self._modes_row = QWidget(self)
        self.mode = QSpinBox(self)
        self.mode.setRange(1, 1)
        self.mode.setPrefix("Mode ")
        self.mode.setAccessibleName("Mode shown")
        plain_number(self.mode)
        self.mode.valueChanged.connect(self._mode_asked)
        self.play = QToolButton(self)
        self.play.setCheckable(True)
        self.play.setChecked(True)
        self.play.setToolTip("Let the mode swing")
        self.play.setAccessibleName("Play")
        self.play.toggled.connect(self._mode_asked)
        self.wave = QLabel(self)
        self.swing = QSlider(Qt.Orientation.Horizontal, self)
        self.swing.setRange(1, SWINGS)
        self.swing.setValue(round(REACH / FARTHEST * SWINGS))
        self.swing.setAccessibleName("How far the mode swings")
        self.swing.setToolTip("How far the mode swings")
        self.swing.valueChanged.connect(self._swing_slid)
        line = QHBoxLayout()
        line.setSpacing(GRID)
        line.addWidget(self.mode, 1)
        line.addWidget(self.wave)
        line.addWidget(self.play)
        lines = QVBoxLayout(self._modes_row)
        lines.setContentsMargins(0, 0, 0, 0)
        lines.setSpacing(GRID // 2)
        lines.addLayout(line)
        lines.addLayout(self._between("Little", self.swing, "Much"))
        self._modes_row.hide()
        self.body.addLayout(figures)
        self.body.addWidget(self._modes_row)
        self._low = False
        self._pair = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        self._pair.setSpacing(GRID)
        self._pair.addWidget(self.histogram)
        self._pair.addWidget(self.curve)
        self.body.addLayout(self._pair)
        self._charts = QTimer(self)
        self._charts.setSingleShot(True)
        self._charts.setInterval(CHART_MS)
        self._charts.timeout.connect(self._show_charts)
        session.document_changed.connect(self._keep_up)
        session.decomposition_changed.connect(self._keep_up)
        self.refresh()

    def _between(self, low: str, slider: QSlider, high: str) -> QHBoxLayout:
        """Return a slider between the words for its ends; the sliders of the panel line up."""
        row = QHBoxLayout()
        row.setSpacing(GRID)
        words = QLabel(low, self), QLabel(high, self)
        for word in words:
            word.setMinimumWidth(word.fontMetrics().horizontalAdvance("Large"))
        words[1].setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._ends += words
        row.addWidget(words[0])
        row.addWidget(slider, 1)
        row.addWidget(words[1])
        return row

    def set_low(self, on: bool) -> None:
        """Put the two charts side by side in a low window: the steps need the height more."""
        self._low = on
        self._lay_charts()

    def _lay_charts(self) -> None:
        # Likewise while modes are seen: their two rows take what the charts give.
        way, beside = QBoxLayout.Direction, self._low or not self._modes_row.isHidden()
        self._pair.setDirection(way.LeftToRight if beside else way.TopToBottom)

    def set_viewer(self, viewer: ModesViewer) -> None:
        """Let the button show modes in `viewer`."""
        self._viewer = viewer
        viewer.changed.connect(self._viewer_changed)

    def _modes_toggled(self, on: bool) -> None:
        if self._viewer is None:
            return
        if on:
            self._mode_asked()
        else:
            self._viewer.hide()

    def _mode_asked(self) -> None:
        known = self._session.decomposition
        if self._viewer is None or known is None or not self.modes_button.isChecked():
            return
        self.mode.setMaximum(max(known.k, 1))
        self._viewer.show(self.mode.value(), self.play.isChecked())

    def _swing_slid(self, tick: int) -> None:
        if self._viewer is not None:
            self._viewer.set_reach(FARTHEST * tick / SWINGS)

    def _viewer_changed(self) -> None:
        shown = self._viewer is not None and self._viewer.mode is not None
        known, document = self._session.decomposition, self._session.document
        self._modes_row.setVisible(shown)
        self._lay_charts()
        with QSignalBlocker(self.modes_button):
            self.modes_button.setChecked(shown)
        if shown and known is not None and document is not None:
            length = known.wavelength(self.mode.value())
            self.wave.setText(f"{figure(length, 3)} {document.unit} long")

    def name_keys(self, read: Read) -> None:
        """Say the keys that move the level, as `read` knows them."""
        words = "Level of detail: {level.less} and {level.more}, or Alt+wheel in the viewport"
        self.slider.setToolTip(plain(words, read))

    def dress(self, theme: Theme) -> None:
        """Take the colours of `theme`."""
        super().dress(theme)
        self.modes_button.setIcon(icon("mdi6.waves", theme))
        self.play.setIcon(icon("mdi6.play", theme))
        self.histogram.dress(theme)
        self.curve.dress(theme)
        for label in self._ends:
            label.setStyleSheet(f"color: {theme.faint};")

    def _keep_up(self) -> None:
        self._session.turn.once(self.refresh)

    def refresh(self) -> None:
        """Show the level of the current document."""
        if not self._charts.isActive():
            self._charts.start()
        document, known = self._session.document, self._session.decomposition
        on = document is not None and document.draft.roi is not None
        for widget in (self.slider, self.percent, self.feature, self.feature_slider, self.modes):
            widget.setEnabled(on)
        self.modes_button.setEnabled(on and known is not None and known.k > 0)
        # Without a region there is nothing to draw: their room is that of the steps.
        self.histogram.setVisible(on)
        self.curve.setVisible(on)
        if document is None:
            return
        level = document.draft.level
        with QSignalBlocker(self.slider), QSignalBlocker(self.percent):
            self.slider.setValue(round(level * TICKS))
            places = percent_places(level)
            if places != self.percent.decimals():
                self.percent.setDecimals(places)
            if round(self.percent.value(), places) != round(level * 100, places):
                self.percent.setValue(level * 100)
        if known is None:
            self.modes.setText("–")
            return
        k = known.mode_count(level)
        self.modes.setText(mode_words(known, k))
        self.feature.set_unit(document.unit)
        size = known.wavelength(k)
        if k > 0 and not math.isfinite(size):
            return  # its mode is not there yet: what was shown stays until it comes
        with QSignalBlocker(self.feature):
            self.feature.setValue(size if k > 0 else 0.0)
        # Many places of the slider stand for the same mode: it stays where the person left it.
        if count_at(known, self.feature_slider.value() / TICKS) != k:
            with QSignalBlocker(self.feature_slider):
                self.feature_slider.setValue(round(place_of(known, k) * TICKS))

    def _feature_typed(self) -> None:
        known = self._session.decomposition
        size = self.feature.value()
        if known is None or size <= 0 or not self.feature.hasFocus():
            return
        self._session.slide_level(known.level_of(known.mode_count_at(size)))

    def _feature_slid(self, tick: int) -> None:
        known = self._session.decomposition
        if known is not None:
            self._session.slide_level(known.level_of(count_at(known, tick / TICKS)))

    def _cutoff_dragged(self, cutoff: float) -> None:
        known = self._session.decomposition
        if known is not None:
            self._session.slide_level(known.level_of(known.curve.count_at(cutoff)))

    def _modes_asked(self, k: int) -> None:
        known = self._session.decomposition
        if known is not None:
            self._session.slide_level(known.level_of(k))

    def _show_charts(self) -> None:
        document, known = self._session.document, self._session.decomposition
        k = 0 if document is None or known is None else known.mode_count(document.draft.level)
        self.histogram.show_level(known, k, "mm" if document is None else document.unit)
        self.curve.show_level(known, k)


def count_at(known: Decomposition, place: float) -> int:
    """Return how many modes a place 0..1 of the smallest feature's slider stands for.

    0 is the base; from there to 1 the length falls from the first mode's to the last one's, by the
    same factor for the same way.
    """
    if place <= 0:
        return 0
    if place >= 1:
        return known.m
    longest, shortest = known.wavelength(1), known.wavelength(known.m)
    if not math.isfinite(longest):
        return 0  # no mode is there yet
    return known.mode_count_at(longest * (shortest / longest) ** place)


def place_of(known: Decomposition, k: int) -> float:
    """Return the place 0..1 of the smallest feature's slider that stands for k modes."""
    longest, shortest = known.wavelength(1), known.wavelength(known.m)
    if k <= 0 or not 0 < shortest < longest < math.inf:
        return 0.0 if k <= 0 else 1.0
    place = math.log(longest / known.wavelength(k)) / math.log(longest / shortest)
    return min(max(place, 1 / TICKS), 1.0)


def mode_words(known: Decomposition, k: int) -> str:
    """Say how many modes are shown, of how many."""
    if k == 0:
        return "0, the base shape"
    if k >= known.m:
        return f"all {known.m:,}"
    if k > known.k:
        return f"{known.k:,} of {k:,} so far"
    return f"{k:,} of {known.m:,}"


def percent_places(level: float) -> int:
    """Return how many decimals, 1 to 4, tell a level between its ends apart from these."""
    if level <= 0.0 or level >= 1.0:
        return 1
    return next((d for d in range(1, 4) if 0.0 < round(level * 100, d) < 100.0), 4)


def _number(suffix: str, low: float, high: float, decimals: int, name: str) -> DecimalField:
    box = DecimalField()
    box.setRange(low, high)
    box.setDecimals(decimals)
    box.setSuffix(suffix)
    box.setAccessibleName(name)
    plain_number(box)
    return box
