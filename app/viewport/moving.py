"""At rest and in motion: a plain, light picture while things move, the best one when they rest."""

from __future__ import annotations

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.canvas import Canvas

REST_MS = 160
SLOW_FRAME_MS = 80.0
HEAVY_FACES = 150_000


class Moving(Canvas):
    """Knows whether the picture moves.

    Signals
    -------
    rested : the camera has come to rest.
    """

    rested = Signal()

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self._rest_timer = QTimer(self)
        self._rest_timer.setSingleShot(True)
        self._rest_timer.setInterval(REST_MS)
        self._rest_timer.timeout.connect(self._rest)

    def _changed(self) -> None:
        """Draw soon, plainly while things move; at rest once more, at its best."""
        if self._software and self.renderer.GetUseFXAA():
            self.renderer.SetUseFXAA(False)
        self._rest_timer.start()
        self.update()

    def _lighten(self) -> None:
        if self._heavy and self._full_frame_ms > SLOW_FRAME_MS:
            self.scene.use_stand_in(True)

    @property
    def moving(self) -> bool:
        """Whether the picture changed so recently that it is still drawn plainly."""
        return self._rest_timer.isActive() or self._held_in_motion()

    def _held_in_motion(self) -> bool:
        """Whether something moves the camera, though it may pause."""
        return False

    @property
    def _heavy(self) -> bool:
        surface = self.scene.surface
        return surface is not None and len(surface.faces) > HEAVY_FACES

    def _rest(self) -> None:
        if self._held_in_motion():
            self._rest_timer.start()
            return
        self.scene.use_stand_in(False)
        self.renderer.SetUseFXAA(self._filtered)
        self.update()
        self.rested.emit()
