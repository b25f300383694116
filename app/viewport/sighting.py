"""Sighting: what the camera sees of the form, for picking and for the lasso."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.idimage import capture
from app.viewport.layers import Layers
from app.viewport.picking import Sight
from engine.arrays import I64
from engine.mesh import Mesh
from plugins.api import Hit

_NONE: I64 = np.zeros(0, dtype=np.int64)


class Sighting(Layers):
    """Tells what lies under pixels; worked out once for each view."""

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self._sight: tuple[Any, Sight] | None = None

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
        view = self.view()
        key = (view, surface.stamp, self.device_size())
        if self._sight is not None and self._sight[0] == key:
            return self._sight[1]
        ids = capture(self.render_window, self.renderer, surface.actor)[::-1]
        sight = Sight(
            np.ascontiguousarray(ids),
            view,
            self.devicePixelRatioF(),
            self._vertices.copy(),
            self._form.faces,
        )
        self._sight = (key, sight)
        return sight

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

    def faces_under(self, path: ArrayLike) -> I64:
        """Return ids of the visible triangles below a path (p, 2), in the path's order."""
        sight = self.sight()
        return _NONE if sight is None else sight.faces_under(path)
