"""Looking: the camera as numbers, and every way to ask for another one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from weakref import WeakSet

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from app.look import DARK, Theme
from app.viewport.camera import Eye
from app.viewport.cube import ViewCube, outward
from app.viewport.hands import ORBIT_PER_PIXEL
from app.viewport.moving import Moving
from app.viewport.navigation import Navigation
from app.viewport.recall import eye_from
from engine.arrays import F64, I64
from engine.view import View
from plugins.api import Side

CUBE_MARGIN = 12


class Looking(Moving):
    """Where one looks from.

    Signals
    -------
    camera_changed : the camera moved.
    """

    camera_changed = Signal()

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self._linked: WeakSet[Looking] = WeakSet()
        self._view: tuple[Any, View] | None = None  # what it was taken of, and the view
        self.cube = ViewCube(self)
        self.cube.set_theme(theme)
        self.navigation = Navigation(self)
        self.navigation.moved.connect(self._camera_moved)
        self.cube.chosen.connect(self.navigation.standard_view)
        self.cube.turned.connect(
            lambda dx, dy: self.turn_by(-ORBIT_PER_PIXEL * dx, ORBIT_PER_PIXEL * dy)
        )
        self.rested.connect(self._apply_eye)  # what moved meanwhile lies between other planes

    def resizeGL(self, width: int, height: int) -> None:
        """Follow the widget's size."""
        super().resizeGL(width, height)
        self.cube.move(self.width() - self.cube.width() - CUBE_MARGIN, CUBE_MARGIN)
        self._apply_eye()

    def view(self) -> View:
        """Return the camera as numbers: mesh units to logical pixels."""
        width, height = self.device_size()
        camera = self.renderer.GetActiveCamera()
        ratio, placement = self.devicePixelRatioF(), self.scene.placement
        taken = (camera.GetMTime(), width, height, ratio, placement)
        if self._view is None or self._view[0] != taken:
            m = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
            matrix = np.array(m.GetData()).reshape(4, 4)
            view = View(matrix @ placement.matrix, (width / ratio, height / ratio))
            self._view = (taken, view)
        return self._view[1]

    @property
    def eye(self) -> Eye:
        """Where one looks from, in scene coordinates; frozen, to keep and to give back."""
        return self.navigation.eye

    def recall(self, view: View, animate: bool = True) -> None:
        """Look from where `view` was taken."""
        self.look(eye_from(view, self.scene.placement, self.eye.up), animate)

    def look(self, eye: Eye, animate: bool = True) -> None:
        """Look from `eye`, flying there; any movement of the hand ends the flight."""
        self.navigation.look(eye, animate)

    def standard_view(self, name: str, animate: bool = True) -> None:
        """Look from "front", "back", "left", "right", "top", "bottom" or "three-quarter"."""
        self.navigation.standard_view(name, animate)

    def towards(self, side: Side) -> F64:
        """Return the unit direction (3,) to a side of the form, as the view cube names it."""
        return outward(side, self.eye.up)

    def frame(self, ids: I64 | None = None, animate: bool = True) -> None:
        """Bring the vertices `ids`, or the whole form, into the picture."""
        if self.scene.surface is not None:
            points = self.scene.surface.positions
            chosen = points if ids is None or len(ids) == 0 else points[ids]
            self.navigation.frame(chosen, animate)

    @property
    def perspective(self) -> bool:
        """Whether the picture is in perspective."""
        return self.eye.perspective

    def set_perspective(self, wanted: bool) -> None:
        """Look in perspective, or orthographically with the same size at the centre."""
        self.look(replace(self.eye, perspective=wanted), animate=False)

    def set_up_axis(self, axis: str) -> None:
        """Take "z" or "y" as the direction that is upright on screen."""
        self.look(replace(self.eye, up={"y": 1, "z": 2}[axis]), animate=False)

    def turn_by(self, azimuth: float, elevation: float) -> None:
        """Turn about the middle of the picture, by angles in radians."""
        self.navigation.turn_by(azimuth, elevation)

    def zoom_at(self, x: float, y: float, factor: float) -> None:
        """Zoom so that what is under a pixel stays there."""
        self.navigation.zoom_at(x, y, factor)

    @property
    def turntable(self) -> bool:
        """Whether the form turns by itself."""
        return self.navigation.turning

    def set_turntable(self, wanted: bool) -> None:
        """Turn the form slowly about its up axis until somebody takes hold of it."""
        self.navigation.turn(wanted)

    def link(self, other: Looking) -> None:
        """Let both viewports look from the same place until one of them is closed."""
        self._linked.add(other)
        other._linked.add(self)
        other.look_as(self)

    def unlink(self, other: Looking) -> None:
        """Let both viewports look from where they like again."""
        self._linked.discard(other)
        other._linked.discard(self)

    def look_as(self, other: Looking) -> None:
        """Look from where another viewport looks."""
        here, there, eye = self.scene.placement, other.scene.placement, other.eye
        if here.scale != there.scale or (here.centre != there.centre).any():
            centre = here.to_scene(there.to_mesh(eye.centre))
            eye = replace(eye, centre=centre, distance=eye.distance * here.scale / there.scale)
        if not eye.same_as(self.eye):
            self.look(eye, animate=False)

    def _held_in_motion(self) -> bool:
        return self.navigation.flying

    def _camera_moved(self) -> None:
        if self._closed:
            return
        self._apply_eye()
        self._lighten()
        self._changed()
        for other in list(self._linked):
            other.look_as(self)
        self.camera_changed.emit()

    def _apply_eye(self) -> None:
        self.eye.apply(self.renderer.GetActiveCamera(), self.scene.radius)
        self.scene.seen_from(self.eye, self.view_height())
        self.cube.follow(self.eye)
