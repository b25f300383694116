"""A heavy form drawn on a processor, some of it in each turn of the loop: the picture, then ids.

A form of a million vertices keeps a processor busy for 200 ms and more. What is on screen meanwhile
is the lighter form; nothing of the work shows before it is whole, and any change gives it up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.viewport.idimage import alone, bare, numbered, read
from app.viewport.scene import Scene

if TYPE_CHECKING:
    from app.viewport.canvas import Canvas

PAUSE_MS = 1  # between two turns: what waits in the window comes first


class Gradual(QObject):
    """Draws the pieces of a scene one after the other into the window's buffer.

    Signals
    -------
    drawn : the picture is in the buffer and wants to be shown.
    seen(ids) : (height, width) int32, the triangle seen at each device pixel, -1 for none; row
        0 is the bottom.
    """

    drawn = Signal()
    seen = Signal(object)

    def __init__(self, canvas: Canvas) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._turns: Iterator[None] = iter(())
        self._timer = QTimer(self)
        self._timer.setInterval(PAUSE_MS)
        self._timer.timeout.connect(self._turn)

    @property
    def _window(self) -> Any:
        return self._canvas.render_window

    @property
    def _renderer(self) -> Any:
        return self._canvas.renderer

    @property
    def _scene(self) -> Scene:
        return self._canvas.scene

    @property
    def under_way(self) -> bool:
        """Whether something is being drawn."""
        return self._timer.isActive()

    def draw(self, filtered: bool) -> None:
        """Begin to draw the picture.

        Parameters
        ----------
        filtered : smooth its edges at the end.
        """
        self._begin(self._picture(filtered))

    def number(self) -> None:
        """Begin to draw which triangle is seen where."""
        self._begin(self._numbers())

    def finish(self) -> None:
        """Do all that is left at once."""
        while self.under_way:
            self._turn()

    def give_up(self) -> None:
        """What was being drawn is out of date."""
        self._timer.stop()
        self._turns = iter(())

    def _begin(self, turns: Iterator[None]) -> None:
        self._turns = turns
        self._timer.start()

    def _turn(self) -> None:
        if next(self._turns, self) is self:
            self.give_up()

    def _picture(self, filtered: bool) -> Iterator[None]:
        pieces = self._scene.pieces
        assert pieces is not None
        for number in range(len(pieces)):
            self._render([pieces.actor(number)], first=number == 0)
            yield
        # The marks are drawn last: what is translucent needs the form behind it.
        with self._kept(False), self._marks_only():
            self._renderer.SetUseFXAA(filtered)
            self._rendered()
        self.give_up()
        self.drawn.emit()

    def _numbers(self) -> Iterator[None]:
        pieces = self._scene.pieces
        assert pieces is not None
        first = 0
        for number, count in enumerate(pieces.counts):
            actor = pieces.actor(number)
            self._render([actor], number == 0, partial(numbered, actor, first), plain=True)
            first += count
            yield
        drawn = read(self._window)
        yield
        ids: NDArray[np.int32] = pieces.numbers[drawn]
        self.give_up()
        self.seen.emit(ids)

    def _render(
        self,
        actors: list[Any],
        first: bool,
        dressed: Callable[[], Any] | None = None,
        plain: bool = False,
    ) -> None:
        """Draw `actors` alone over what was drawn before, unless they are the first."""
        with ExitStack() as stack:
            stack.enter_context(alone(self._renderer, actors))
            if plain:
                stack.enter_context(bare(self._window, self._renderer))
            if dressed is not None:
                stack.enter_context(dressed())
            stack.enter_context(self._kept(first))
            self._renderer.SetUseFXAA(False)
            swap = self._window.GetSwapBuffers()
            self._window.SwapBuffersOff()  # not for the screen
            self._rendered()
            self._window.SetSwapBuffers(swap)

    def _rendered(self) -> None:
        interactor = self._window.GetInteractor()
        self._window.MakeCurrent()
        interactor.EnableRenderOn()
        self._window.Render()
        interactor.EnableRenderOff()

    @contextmanager
    def _kept(self, first: bool) -> Iterator[None]:
        """Keep what was drawn before."""
        self._renderer.SetPreserveColorBuffer(not first)
        self._renderer.SetPreserveDepthBuffer(not first)
        try:
            yield
        finally:
            self._renderer.SetPreserveColorBuffer(False)
            self._renderer.SetPreserveDepthBuffer(False)

    @contextmanager
    def _marks_only(self) -> Iterator[None]:
        """Show what lies on the form, and not the form."""
        standing_in = self._scene.stand_in
        assert standing_in is not None
        standing_in.surface.actor.VisibilityOff()
        try:
            yield
        finally:
            standing_in.surface.actor.VisibilityOn()
