"""Trace bar: fades, sizes, moves and takes away the picture that is traced."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QRectF, QSignalBlocker, QSize, QSizeF, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QSlider, QWidget

from app.panels.panel import GRID
from app.viewport import Viewport

HEIGHT = 44  # as of the bar above the form


class TraceBar(QFrame):
    """A strip below the form; shown while there is a picture.

    The picture keeps its place on the form when the room for both changes: the form's size on
    screen goes with the height of the viewport, and so does the picture's.
    """

    def __init__(self, viewport: Viewport, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._viewport = viewport
        self._image = QImage()
        self._room = QSize()  # of the viewport when the picture was laid over it
        self.setAccessibleName("Picture to trace")
        title = QLabel("Trace", self)
        title.setStyleSheet("font-weight: 600;")
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(2 * GRID, GRID // 2, 2 * GRID, GRID // 2)
        self._row.setSpacing(GRID)
        self._row.addWidget(title)
        self.fade = self._slider("Shows", 0, 100)
        self.size_slider = self._slider("Size", 10, 300)
        self.across = self._slider("Across", -100, 100)
        self.down = self._slider("Down", -100, 100)
        self._row.addStretch(1)
        gone = QPushButton("Remove", self)
        gone.clicked.connect(lambda _on=False: self.remove())
        self._row.addWidget(gone)
        self.setFixedHeight(HEIGHT)
        self.hide()
        viewport.installEventFilter(self)

    def trace(self, image: QImage) -> None:
        """Lay a picture over the form, in the middle and half shown."""
        self._image = image
        self._room = self._viewport.size()
        for slider, start in (
            (self.fade, 50),
            (self.size_slider, 100),
            (self.across, 0),
            (self.down, 0),
        ):
            with QSignalBlocker(slider):
                slider.setValue(start)
        self._lay()
        self.show()

    def remove(self) -> None:
        """Take the picture away."""
        self._viewport.set_backdrop(None)
        self.hide()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep the picture where it lies on the form when the viewport changes its size."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._lay()
        return super().eventFilter(watched, event)

    def _lay(self) -> None:
        view, room = self._viewport, self._room
        fitting = QSizeF(self._image.size()).scaled(room, Qt.AspectRatioMode.KeepAspectRatio)
        taller = view.height() / max(room.height(), 1)
        size = fitting * (taller * self.size_slider.value() / 100)
        half = QSizeF(room) * (taller / 2)
        left = (view.width() - size.width()) / 2 + self.across.value() / 100 * half.width()
        top = (view.height() - size.height()) / 2 + self.down.value() / 100 * half.height()
        place = QRectF(left, top, size.width(), size.height())
        view.set_backdrop(self._image, self.fade.value() / 100, place)

    def _slider(self, words: str, low: int, high: int) -> QSlider:
        slider = QSlider(Qt.Orientation.Horizontal, self)
        slider.setRange(low, high)
        slider.setMinimumWidth(24)
        slider.setMaximumWidth(160)
        slider.setMinimumHeight(32)
        slider.setAccessibleName(words)
        slider.valueChanged.connect(lambda _value: self._lay())
        self._row.addWidget(QLabel(words, self))
        self._row.addWidget(slider, 1)
        return slider
