"""At rest and in motion: a plain, light picture while things move, the best one when they rest."""

from __future__ import annotations

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.canvas import Canvas
from app.viewport.gradual import Gradual
from app.viewport.heavy import HEAVY_FACES

REST_MS = 160
SLOW_FRAME_MS = 80.0


class Moving(Canvas):
    """Knows whether the picture moves.

    A heavy form turns as a lighter one. At rest a graphics card draws it as it is; a processor
    draws it in pieces, some in each turn of the loop, and it is shown when all are there.

    Signals
    -------
    rested : the camera has come to rest.
    """

    rested = Signal()

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self.gradual = Gradual(self)
        self.gradual.drawn.connect(self._show_drawn)
        self._rest_timer = QTimer(self)
        self._rest_timer.setSingleShot(True)
        self._rest_timer.setInterval(REST_MS)
        self._rest_timer.timeout.connect(self._rest)

    def paintGL(self) -> None:
        """Render what can be rendered in a moment, or show what is in the buffer."""
        if self._only_show:
            super().paintGL()
            self._only_show = False
            self._shown_whole()
            return
        if self._software and self._heavy:
            self.scene.draw_in_pieces()
            self._give_up_whole()
            self.renderer.SetUseFXAA(False)
            self._rest_timer.start()
        super().paintGL()

    @property
    def moving(self) -> bool:
        """Whether the picture changed so recently that it is still drawn plainly."""
        return (
            self._rest_timer.isActive()
            or self._held_in_motion()
            or self.gradual.under_way
            or self._only_show
        )

    def _changed(self) -> None:
        """Draw soon, plainly while things move; at rest once more, at its best."""
        self._give_up_whole()
        if self._software and self.renderer.GetUseFXAA():
            self.renderer.SetUseFXAA(False)
        self._rest_timer.start()
        self.update()

    def _lighten(self) -> None:
        if self._heavy and self._full_frame_ms > SLOW_FRAME_MS:
            self.scene.use_stand_in(True)

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
        if self.scene.pieces is not None:
            self.rested.emit()
            self._rest_timer.stop()  # what follows the rest may have asked for a frame: it is in it
            self.gradual.draw(self._filtered)
            return
        self.scene.use_stand_in(False)
        self.renderer.SetUseFXAA(self._filtered)
        self.update()
        self.rested.emit()

    def _show_drawn(self) -> None:
        """The picture of the whole form is in the window's buffer."""
        self._only_show = True
        self.update()

    def _give_up_whole(self) -> None:
        """What is drawn in pieces, or waits to be shown, is out of date."""
        self.gradual.give_up()
        self._only_show = False

    def _shown_whole(self) -> None:
        """The picture of the whole form is on the screen."""
