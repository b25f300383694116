"""Viewport: the form on screen, rendered once per frame, and the hands on it.

It knows no document and no tool. Pixels at its public interface are logical pixels from the top
left corner; positions are in mesh units.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any
from weakref import WeakSet

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QComboBox, QLineEdit, QWidget
from pyvistaqt import QtInteractor

from app.look import DARK, Theme
from app.viewport.camera import Eye
from app.viewport.cube import ViewCube
from app.viewport.hands import ORBIT_PER_PIXEL, Hands
from app.viewport.idimage import capture
from app.viewport.maps import Maps
from app.viewport.navigation import Navigation
from app.viewport.overlay import Backdrop, Overlay, SpaceCurve
from app.viewport.picking import Sight
from app.viewport.picture import as_image, rendered
from app.viewport.recall import eye_from
from app.viewport.scene import Scene
from app.viewport.shading import Display
from engine.arrays import F64, I64
from engine.mesh import Mesh
from engine.view import View
from plugins.api import Hit, Pointer

REST_MS = 160
SLOW_FRAME_MS = 80.0
HEAVY_FACES = 150_000
CUBE_MARGIN = 12
_SAMPLES = 8
_NONE: I64 = np.zeros(0, dtype=np.int64)
_TYPED_INTO = (QLineEdit, QAbstractSpinBox, QComboBox)


class Viewport(QtInteractor):
    """The form on screen.

    Signals
    -------
    pointer : `plugins.api.Pointer` of the left button, the pen tip, or hovering.
    cancelled : the gesture under way will have no release.
    camera_changed : the camera moved.
    rested : the camera has come to rest.
    alt_scrolled : notches of the wheel turned with Alt held.
    looks_changed : the form is coloured in another way, or its edges are drawn or not.
    """

    pointer = Signal(object)
    cancelled = Signal()
    camera_changed = Signal()
    rested = Signal()
    alt_scrolled = Signal(float)
    looks_changed = Signal()

    def __init__(self, parent: QWidget | None = None, theme: Theme = DARK) -> None:
        super().__init__(parent, auto_update=False, multi_samples=0, lighting="none")
        self.setAcceptDrops(False)
        self.setTabletTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_AcceptTouchEvents)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(160, 120)
        # VTK renders when Qt paints, and never else: one render for each frame.
        interactor = self.render_window.GetInteractor()
        interactor.EnableRenderOff()
        interactor.AddObserver("RenderEvent", self._render_wanted)
        self.disable_picking()

        self.renders = 0
        self.frame_ms = 0.0
        self._full_frame_ms = 0.0
        self._form: Mesh | None = None
        self._vertices: F64 = np.zeros((0, 3))
        self._sight: tuple[Any, Sight] | None = None
        self._tool_cursor: Any = None
        self._software: bool | None = None
        self._linked: WeakSet[Viewport] = WeakSet()
        self.scene = Scene(self.renderer, theme)
        self.overlay = Overlay(self)
        self.overlay.set_theme(theme)
        self.cube = ViewCube(self)
        self.cube.set_theme(theme)
        self.maps = Maps(self)
        self.navigation = Navigation(self)
        self.navigation.moved.connect(self._camera_moved)
        self.cube.chosen.connect(self.navigation.standard_view)
        self.cube.turned.connect(
            lambda dx, dy: self.turn_by(-ORBIT_PER_PIXEL * dx, ORBIT_PER_PIXEL * dy)
        )
        self._rest_timer = QTimer(self)
        self._rest_timer.setSingleShot(True)
        self._rest_timer.setInterval(REST_MS)
        self._rest_timer.timeout.connect(self._rest)
        self.hands = Hands(self, self.navigation)
        self._apply_eye()

    # Rendering

    def _render_wanted(self, *_: Any) -> None:
        if not self._in_paint:
            self.update()

    def render(self, *_: Any, **__: Any) -> None:
        """Ask for a frame; whoever asks ten times before it comes gets one."""
        self._rendered = True
        self.update()

    def paintGL(self) -> None:
        """Render the scene, once."""
        window = self._RenderWindow
        interactor = window.GetInteractor() if window is not None else None
        if interactor is not None:
            interactor.EnableRenderOn()
        begin = time.perf_counter()
        try:
            super().paintGL()
        finally:
            if interactor is not None:
                interactor.EnableRenderOff()
        self.renders += 1
        self.frame_ms = 1e3 * (time.perf_counter() - begin)
        if self.scene.surface is not None and self.scene.surface.actor.GetVisibility():
            self._full_frame_ms = self.frame_ms

    def initializeGL(self) -> None:
        """Prepare OpenGL: many samples on a graphics card, a cheap filter on a processor."""
        super().initializeGL()
        name = str(self.context().functions().glGetString(0x1F01) or "").lower()
        self._software = any(word in name for word in ("llvmpipe", "softpipe", "swrast"))
        self.render_window.SetMultiSamples(0 if self._software else _SAMPLES)
        self.renderer.SetUseFXAA(self._software)

    def resizeGL(self, width: int, height: int) -> None:
        """Follow the widget's size."""
        super().resizeGL(width, height)
        self.overlay.setGeometry(self.rect())
        self.cube.move(self.width() - self.cube.width() - CUBE_MARGIN, CUBE_MARGIN)
        self.scene.scale = self.devicePixelRatioF()
        self._apply_eye()

    @property
    def software(self) -> bool:
        """Whether OpenGL runs on the processor; known once the window has been shown."""
        return bool(self._software)

    # The form

    @property
    def form(self) -> Mesh | None:
        """The mesh that was set; `vertices` tells where its vertices are shown now."""
        return self._form

    @property
    def vertices(self) -> F64:
        """Positions as shown, (n, 3), mesh units."""
        return self._vertices

    def set_mesh(self, mesh: Mesh, keep_camera: bool = False) -> None:
        """Show a mesh, framed three-quarter, or from where one looks now."""
        before = self.scene.placement
        self.scene.set_mesh(mesh)
        self._form = mesh
        self._vertices = mesh.vertices.copy()
        self._sight = None
        after = self.scene.placement
        if keep_camera:
            scale = after.scale / before.scale
            centre = after.to_scene(before.to_mesh(self.eye.centre))
            moved = replace(self.eye, centre=centre, distance=self.eye.distance * scale)
            self.look(moved, animate=False)
        else:
            self.standard_view("three-quarter", animate=False)
            self.frame(animate=False)
        self._apply_eye()
        self.maps.new_form()
        self._changed()

    def set_vertices(self, positions: ArrayLike, changed_ids: I64 | None = None) -> None:
        """Move the form.

        Parameters
        ----------
        positions : (n, 3) of all vertices, or (m, 3) of `changed_ids`, mesh units.
        changed_ids : (m,) the vertices that moved; the same array again and again is fastest.
        """
        if self.scene.surface is None:
            return  # closed, while a result was still on its way
        p = np.asarray(positions, dtype=np.float64)
        if changed_ids is None:
            self._vertices[:] = p
        else:
            if len(p) != len(changed_ids):
                p = p[changed_ids]
            self._vertices[changed_ids] = p
        self.scene.move(p, changed_ids)
        self.maps.moved()
        self._lighten()
        self._changed()

    def set_region(self, ids: I64 | None) -> None:
        """Tint the vertices `ids` as the region and draw their rim; None for no region."""
        self.scene.set_region(ids)
        self.update()

    def set_colours(self, colours: ArrayLike | None) -> None:
        """Colour every vertex, (n, 3) uint8, instead of clay and region; None for clay."""
        self.scene.set_map(None if colours is None else np.asarray(colours, dtype=np.uint8))
        self.update()

    def ghost(self, positions: ArrayLike | None) -> None:
        """Show other positions (n, 3) of the same mesh, translucent, where they differ."""
        self.scene.set_ghost(positions)
        self.update()

    def set_pins(self, points: ArrayLike | None) -> None:
        """Show pins at `points` (p, 3); None for no pins."""
        self.scene.set_pins(points)
        self.update()

    def set_plane(self, plane: ArrayLike | None) -> None:
        """Show where a plane of symmetry a, b, c, d cuts the form; None for none."""
        self.scene.set_plane(plane)
        self.update()

    def show_sheet(self, wanted: bool) -> None:
        """Show that plane as a translucent sheet as well, or not."""
        self.scene.show_sheet(wanted)
        self.update()

    def show_curve(
        self,
        name: str,
        points: ArrayLike,
        role: str,
        closed: bool = False,
        anchors: ArrayLike | None = None,
        label: str = "",
    ) -> None:
        """Show a curve (p, 3) under a name until `hide_curve(name)`.

        A target or a guide is drawn over everything; any other curve lies on the form and is hidden
        by what is in front of it.
        """
        self.hide_curve(name)
        if role in ("target", "guide"):
            p = np.atleast_2d(np.asarray(points, dtype=np.float64))
            self.overlay.set_curve(name, SpaceCurve(p, role, closed, label))
            self.overlay.follow(self.view())
        else:
            self.scene.show_curve(name, points, role, closed, anchors)
        self.update()

    def hide_curve(self, name: str) -> None:
        """Take the curve of that name away, if there is one."""
        self.overlay.set_curve(name, None)
        self.scene.hide_curve(name)
        self.update()

    def set_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.scene.set_theme(theme)
        self.overlay.set_theme(theme)
        self.cube.set_theme(theme)
        self.update()

    # Ways to look

    @property
    def display(self) -> Display:
        """What the form is coloured by: clay, zebra, reflection, curvature or deviation."""
        return self.maps.display

    def set_display(self, display: Display) -> None:
        """Colour the form by clay, by stripes that it reflects, or by a map with its scale."""
        self.maps.show(display)
        self.update()
        self.looks_changed.emit()

    def set_reference(self, positions: ArrayLike | None) -> None:
        """Measure deviation from these positions (n, 3); None for the mesh as it was set."""
        self.maps.set_reference(positions)
        self.update()

    def deviation(self) -> F64:
        """Return the signed distance of each vertex from the reference, (n,), mesh units."""
        return self.maps.deviation()

    @property
    def unit(self) -> str:
        """What one mesh unit is, for scales and measures."""
        return self.maps.unit

    def set_unit(self, unit: str) -> None:
        """Say what one mesh unit is."""
        self.maps.unit = unit
        self.set_display(self.display)

    def set_wireframe(self, wanted: bool) -> None:
        """Draw the edges of the triangles over the form, or not."""
        self.scene.set_wireframe(wanted)
        self.update()
        self.looks_changed.emit()

    @property
    def wireframe(self) -> bool:
        """Whether edges are drawn."""
        return self.scene.wireframe

    @property
    def occlusion_available(self) -> bool:
        """Whether soft shadows in grooves are affordable: on a graphics card only."""
        return self._software is False

    def set_occlusion(self, wanted: bool) -> bool:
        """Darken grooves by ambient occlusion; return whether it is on now."""
        on = wanted and self.occlusion_available
        self.renderer.SetUseSSAO(on)
        self.renderer.SetSSAORadius(6.0)
        self.renderer.SetSSAOBias(0.15)
        self.renderer.SetSSAOKernelSize(64)
        self.renderer.SetSSAOBlur(True)
        # Its passes know no multisampling: edges are smoothed by the filter instead.
        self.render_window.SetMultiSamples(0 if on or self._software else _SAMPLES)
        self.renderer.SetUseFXAA(self._filtered)
        self.scene.set_theme(self.scene.theme)
        self.update()
        return on

    @property
    def _filtered(self) -> bool:
        """Whether edges are smoothed by a filter over the picture, at rest."""
        return self.software or bool(self.renderer.GetUseSSAO())

    # Pictures and measures

    def render_image(self, size: tuple[int, int], transparent: bool = False) -> QImage:
        """Return the form as a picture of `size` device pixels, smooth, without ink over it.

        Parameters
        ----------
        transparent : on nothing instead of the gradient.
        """
        self._ensure_initialized()
        standing_in = self.scene.standing_in
        self.scene.use_stand_in(False)
        pixels = rendered(self.render_window, self.renderer, size, transparent)
        self.scene.use_stand_in(standing_in)
        self.update()
        return as_image(pixels, transparent)

    def measure(
        self, first: tuple[float, float], second: tuple[float, float]
    ) -> tuple[F64, F64, float] | None:
        """Return two points of the surface (3,), under two pixels, and their distance, mesh units.

        None when the form is not under both.
        """
        hits = [self.pick(*first), self.pick(*second)]
        if hits[0] is None or hits[1] is None:
            return None
        a, b = hits[0].point, hits[1].point
        return a, b, float(np.linalg.norm(b - a))

    def show_measure(self, first: ArrayLike | None, second: ArrayLike | None = None) -> None:
        """Draw a line between two points (3,) with their distance; None takes it away."""
        if first is None or second is None:
            self.hide_curve("measure")
            return
        ends = np.array([first, second], dtype=np.float64)
        length = float(np.linalg.norm(ends[1] - ends[0]))
        self.show_curve("measure", ends, "guide", label=f"{length:.4g} {self.unit}")

    def set_backdrop(
        self, image: QImage | None, opacity: float = 0.5, place: QRectF | None = None
    ) -> None:
        """Lay a picture to trace over the form; None takes it away.

        Parameters
        ----------
        opacity : how much of it shows, 0..1.
        place : where it lies, logical pixels; else in the middle, as large as fits.
        """
        if image is None or image.isNull():
            self.overlay.set_backdrop(None)
            return
        if place is None:
            size = QSizeF(image.size()).scaled(
                QSizeF(self.size()) * 0.9, Qt.AspectRatioMode.KeepAspectRatio
            )
            corner = QPointF(self.width() - size.width(), self.height() - size.height()) / 2
            place = QRectF(corner, size)
        self.overlay.set_backdrop(Backdrop(image, place, min(1.0, max(0.0, opacity))))

    def fade_backdrop(self, opacity: float) -> None:
        """Let more or less of the picture to trace show, 0..1."""
        self.overlay.fade_backdrop(opacity)

    # Ink

    def ink(self, path: ArrayLike, role: str, closed: bool = False) -> None:
        """Show a stroke (p, 2) over the picture; nothing is rendered for it."""
        self.overlay.ink(path, role, closed)

    def clear_ink(self) -> None:
        """Take the stroke away."""
        self.overlay.clear_ink()

    def brush(self, x: float, y: float, radius: float | None) -> None:
        """Show the brush as a circle of `radius` px about a point; None takes it away."""
        self.overlay.set_brush(None if radius is None else (x, y, radius))

    def invite(self, path: ArrayLike | None) -> None:
        """Show a dashed lasso (p, 2) that invites to draw there; it goes at the first stroke."""
        self.overlay.set_invitation(path)

    # What is seen

    def view(self) -> View:
        """Return the camera as numbers: mesh units to logical pixels."""
        width, height = self.device_size()
        camera = self.renderer.GetActiveCamera()
        m = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
        matrix = np.array([[m.GetElement(i, j) for j in range(4)] for i in range(4)])
        ratio = self.devicePixelRatioF()
        return View(matrix @ self.scene.placement.matrix, (width / ratio, height / ratio))

    def device_size(self) -> tuple[int, int]:
        """Width and height in device pixels, as VTK renders."""
        ratio = self.devicePixelRatioF()
        return max(1, round(self.width() * ratio)), max(1, round(self.height() * ratio))

    def view_height(self) -> float:
        """Height of the view in logical pixels."""
        return self.device_size()[1] / self.devicePixelRatioF()

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

    # The camera

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

    def frame(self, ids: I64 | None = None, animate: bool = True) -> None:
        """Bring the vertices `ids`, or the whole form, into the picture."""
        if self.scene.surface is not None:
            points = self.scene.surface.positions
            chosen = points if ids is None or len(ids) == 0 else points[ids]
            self.navigation.frame(chosen.astype(np.float64), animate)

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

    def link(self, other: Viewport) -> None:
        """Let both viewports look from the same place until one of them is closed."""
        self._linked.add(other)
        other._linked.add(self)
        other.look_as(self)

    def unlink(self, other: Viewport) -> None:
        """Let both viewports look from where they like again."""
        self._linked.discard(other)
        other._linked.discard(self)

    def look_as(self, other: Viewport) -> None:
        """Look from where another viewport looks."""
        here, there, eye = self.scene.placement, other.scene.placement, other.eye
        if here.scale != there.scale or (here.centre != there.centre).any():
            centre = here.to_scene(there.to_mesh(eye.centre))
            eye = replace(eye, centre=centre, distance=eye.distance * here.scale / there.scale)
        if not eye.same_as(self.eye):
            self.look(eye, animate=False)

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
        self.overlay.follow(self.view())
        self.cube.follow(self.eye)
        self.maps.turned(self.eye)

    # What the hands ask for

    def emit_pointer(self, pointer: Pointer) -> None:
        """Hand an event to whoever holds the tool."""
        if pointer.kind == "press":
            self.navigation.stop()
            self.overlay.set_invitation(None)
        self.pointer.emit(pointer)

    def cancel_pointer(self) -> None:
        """Say that the gesture under way will have no release."""
        self.cancelled.emit()

    def alt_scroll(self, notches: float) -> None:
        """Say that the wheel was turned with Alt held."""
        self.alt_scrolled.emit(notches)

    def set_tool_navigates(self, navigates: bool) -> None:
        """Let strokes of the main button and the pen's tip move the camera, or draw again."""
        if navigates != self.hands.navigates:
            self.hands.navigates = navigates
            self.set_navigating(navigates)

    def set_navigating(self, navigating: bool) -> None:
        """Show by the cursor that the hand moves the camera, not the tool."""
        if navigating and self._tool_cursor is None:
            self._tool_cursor = self.cursor()
            self.setCursor(Qt.CursorShape.SizeAllCursor)
        elif not navigating and self._tool_cursor is not None:
            self.setCursor(self._tool_cursor)
            self._tool_cursor = None

    # Rest and motion

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
        return self._rest_timer.isActive() or self.navigation.flying

    @property
    def _heavy(self) -> bool:
        return self._form is not None and len(self._form.faces) > HEAVY_FACES

    def _rest(self) -> None:
        if self.hands.navigating or self.navigation.flying:
            self._rest_timer.start()
            return
        self.scene.use_stand_in(False)
        self.renderer.SetUseFXAA(self._filtered)
        self.maps.rested()
        self._apply_eye()
        self.update()
        self.rested.emit()

    # Qt events that are not the hands'

    def enterEvent(self, event: Any) -> None:
        """Take the keys when the pointer comes, unless somebody is typing."""
        if not isinstance(QApplication.focusWidget(), _TYPED_INTO):
            self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def leaveEvent(self, event: Any) -> None:
        """Hide the brush when the pointer leaves."""
        self.overlay.set_brush(None)
        event.accept()

    def keyPressEvent(self, event: Any) -> None:
        """Leave the key to the window: VTK's own keys would close it."""
        event.ignore()

    def keyReleaseEvent(self, event: Any) -> None:
        """Leave the key to the window."""
        event.ignore()

    def dragEnterEvent(self, event: Any) -> None:
        """Leave files to the window."""
        event.ignore()

    def dropEvent(self, event: Any) -> None:
        """Leave files to the window."""
        event.ignore()

    def event(self, event: QEvent) -> bool:
        """Handle what Qt sends."""
        if event.type() == QEvent.Type.ShortcutOverride and event.key() == Qt.Key.Key_Space:
            event.accept()
        return bool(super().event(event))

    def sizeHint(self) -> QSize:
        """A canvas wants room."""
        return QSize(960, 720)

    def close(self) -> None:
        """Free everything of OpenGL; call it before the window goes."""
        if getattr(self, "_closed", True):
            return
        for other in list(self._linked):
            self.unlink(other)
        self._rest_timer.stop()
        self.navigation.stop()
        self._sight = None
        self.scene.clear()
        super().close()
