"""Sighting: what the camera sees of the form, for picking and for the lasso."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QWidget

from app.form import Form
from app.look import DARK, Theme
from app.viewport.idimage import capture
from app.viewport.layers import Layers
from app.viewport.picking import Sight
from engine.arrays import I64
from engine.mesh import Mesh
from plugins.api import Hit

_NONE: I64 = np.zeros(0, dtype=np.int64)


class Sighting(Layers):
    """Tells what lies under pixels; worked out once for each view.

    Signals
    -------
    sighted : what is seen of a heavy form was worked out in idle moments, and is at hand.
    """

    sighted = Signal()
    _prepared = Signal(object)

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self._sight: tuple[Any, Sight] | None = None
        self._looked_at: Any = None  # by whatever works out a sight now
        self.gradual.seen.connect(self._take_ids)
        self._prepared.connect(self._take_sight, Qt.ConnectionType.QueuedConnection)

    def set_mesh(self, mesh: Mesh, keep_camera: bool = False) -> None:
        """Show a mesh, framed three-quarter, or from where one looks now."""
        self._sight = None
        super().set_mesh(mesh, keep_camera)

    def sight(self) -> Sight | None:
        """Return what the camera sees of the form now; worked out once for each view."""
        surface = self.scene.surface
        if surface is None or self._form is None:
            return None
        if not self.render_window.GetReadyForRendering():
            return None
        key = self._key()
        if self._sight is not None and self._sight[0] == key:
            return self._sight[1]
        if self.scene.pieces is not None:
            if self._stroke_under_way() and self._sight is not None and self._sight[0][0] == key[0]:
                return self._sight[1]  # the form follows the stroke: what began it still holds
            # Somebody cannot wait for the idle moments.
            self._looked_at = key
            self.gradual.number()
            self.gradual.finish()
            self._rest_timer.start()
            assert self._sight is not None
            return self._sight[1]
        ids = capture(self.render_window, self.renderer, surface.actor)
        self._sight = (key, self._sight_of(ids))
        return self._sight[1]

    def foresee(self) -> None:
        """See what is where now, for the questions that will come.

        A heavy form drawn in pieces is seen in idle moments as it is.
        """
        if self.scene.pieces is None:
            sight = self.sight()
            if sight is not None and not sight.ready:
                self._prepare(sight)

    @property
    def sight_comes(self) -> bool:
        """Whether what is seen is being worked out, and not there yet."""
        if self._sight is None or self._sight[0] != self._key():
            return self.scene.pieces is not None
        return self._heavy and not self._sight[1].ready

    def _stroke_under_way(self) -> bool:
        """Whether a gesture goes on that the form may follow."""
        return False

    def _key(self) -> Any:
        surface = self.scene.surface
        return (self.view(), surface and surface.stamp, self.device_size())

    def _sight_of(self, ids: NDArray[np.int32]) -> Sight:
        assert self._form is not None
        return Sight(
            np.ascontiguousarray(ids[::-1]),
            self.view(),
            self.devicePixelRatioF(),
            Form(self._form, self._moved, self._vertices[self._moved]),
            self._form.faces,
            self._form.topology.incidence,
        )

    def _shown_whole(self) -> None:
        """With the picture on the screen, see what is where, before anybody asks."""
        if self._sight is None or self._sight[0] != self._key():
            self._looked_at = self._key()
            self.gradual.number()

    def _take_ids(self, ids: NDArray[np.int32]) -> None:
        key, self._looked_at = self._looked_at, None
        if key != self._key():
            return
        sight = self._sight_of(ids)
        self._sight = (key, sight)
        self._prepare(sight)

    def _prepare(self, sight: Sight) -> None:
        """Work out in a thread what every question to a sight needs."""

        def wanted() -> bool:
            return self._sight is not None and self._sight[1] is sight

        def prepare() -> None:
            sight.prepare(wanted)
            with suppress(RuntimeError):  # the window was closed meanwhile
                self._prepared.emit(sight)

        threading.Thread(target=prepare, name="sight", daemon=True).start()

    def _take_sight(self, sight: Sight) -> None:
        if self._sight is not None and self._sight[1] is sight and not self.sight_comes:
            self.sighted.emit()

    def pick(self, x: float, y: float) -> Hit | None:
        """Return what is visible at a pixel, or None over the background."""
        sight = self.sight()
        return None if sight is None else sight.pick(x, y)

    def vertices_inside(self, polygon: ArrayLike, through: bool = False) -> I64:
        """Return ids of the vertices inside a closed lasso (p, 2), the visible ones or all."""
        sight = self.sight()
        return _NONE if sight is None else sight.vertices_inside(polygon, through)

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Return ids of the vertices within `radius` px of a point: a brush's touch."""
        sight = self.sight()
        return _NONE if sight is None else sight.vertices_near(x, y, radius, through)

    def faces_at(self, points: ArrayLike) -> I64:
        """Return the id of the visible triangle at each of points (p, 2), (p,); -1 for none."""
        sight = self.sight()
        return np.full(len(np.atleast_2d(points)), -1) if sight is None else sight.faces_at(points)

    def faces_under(self, path: ArrayLike) -> I64:
        """Return ids of the visible triangles below a path (p, 2), in the path's order."""
        sight = self.sight()
        return _NONE if sight is None else sight.faces_under(path)
