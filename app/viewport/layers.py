"""Layers: the form, and all that lies on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from app.form import Form
from app.look import DARK, Theme
from app.viewport.aside import MANY, Aside
from app.viewport.ghost import Plain
from app.viewport.heavy import is_heavy, own
from app.viewport.inking import Inking
from app.viewport.maps import Maps
from app.viewport.overlay import SpaceCurve
from app.viewport.scene import Made, Marked
from app.viewport.shading import Display, Stripes
from app.viewport.surface import Moved
from engine.arrays import F64, I64, distinct
from engine.mesh import Mesh

_NONE: I64 = np.zeros(0, dtype=np.int64)
GhostOf = tuple[ArrayLike, I64 | None, Plain | None]  # what `ghost` was asked for


class Layers(Inking):
    """What is shown of a form.

    Signals
    -------
    looks_changed : the form is coloured in another way, or its edges are drawn or not.
    curved(made) : a map of curvature was worked out in a thread.
    brought : a form that `bring` was asked for is there.
    """

    brought = Signal()
    looks_changed = Signal()
    curved = Signal(object)

    def __init__(self, parent: QWidget | None, theme: Theme = DARK) -> None:
        super().__init__(parent, theme)
        self._form: Mesh | None = None
        self._vertices: F64 = np.zeros((0, 3))
        self._moved: I64 = _NONE  # all that were ever moved
        self._region: I64 | None = None  # as it was asked for
        self._region_timer = self._soon(self._show_region)
        self._plane: ArrayLike | None = None
        self._sheet = False
        self._plane_timer = self._soon(self._show_plane)
        self.aside = Aside(self)
        self._ghost_of: GhostOf | None = None
        self.maps = Maps(self)
        self.rested.connect(self.maps.rested)
        self.curved.connect(self.maps.take_curvature, Qt.ConnectionType.QueuedConnection)

    @property
    def moving(self) -> bool:
        """Whether the picture changed a moment ago, or soon will by itself."""
        soon = self._region_timer.isActive() or self._plane_timer.isActive()
        soon = soon or self.aside.under_way
        return super().moving or self.maps.under_way or soon

    def _soon(self, show: Callable[[], None]) -> QTimer:
        """Return a timer that lets `show` be called once in the next turn of the loop."""
        timer = QTimer(self)
        timer.setSingleShot(True)
        timer.setInterval(1)  # not 0 ms: that would wait until a moving hand pauses
        timer.timeout.connect(show)
        return timer

    def _apply_eye(self) -> None:
        super()._apply_eye()
        self.maps.turned(self.eye)

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
        self._region = self._plane = None
        self._region_timer.stop()
        self._plane_timer.stop()
        self.aside.clear()
        self._ghost_of = None
        arrays = own(mesh) if is_heavy(mesh) else None
        self.scene.set_mesh(mesh, arrays)
        self.overlay.clear_curves()
        self._form = mesh
        self._vertices = mesh.vertices.copy() if arrays is None else arrays.vertices
        self._moved = _NONE
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
        self._note_moved(changed_ids)
        self.scene.move(p, changed_ids)
        self.maps.moved(changed_ids)
        self._lighten()
        self._changed()

    def bring(self, form: Form, ids: I64) -> None:
        """Show a form of the same faces as soon as its arrays are made in a thread; see `brought`.

        What is shown until then stays as it is. Only the newest that was asked for is shown.

        Parameters
        ----------
        ids : the vertices that may be elsewhere in it than they are shown now.
        """
        surface, placement = self.scene.surface, self.scene.placement
        if surface is None:
            return

        def work() -> tuple[F64, Moved]:
            vertices = form.mesh.vertices.copy()
            vertices[form.ids] = form.places
            return vertices, surface.moved_to(placement.to_scene(vertices[ids]), ids)

        def take(made: tuple[F64, Moved]) -> None:
            vertices, moved = made
            if surface.stamp != moved.stamp:
                self.bring(form, self._also_moved(ids))  # it was moved meanwhile
                return
            self._vertices = vertices
            self._note_moved(ids)
            self.scene.take(moved)
            self.maps.moved(ids)
            self._ghost_again(ids)
            self._lighten()
            self._changed()
            self.brought.emit()

        self.aside.ask("form", work, take)

    def keep(self) -> None:
        """Bring no form any more; the one shown stays."""
        self.aside.drop("form")

    def _note_moved(self, ids: I64 | None) -> None:
        n = len(self._vertices)
        if ids is None:
            self._moved = np.arange(n)
        elif not np.array_equal(ids, self._moved) and len(self._moved) < n:
            self._moved = distinct(np.concatenate([self._moved, ids]), n)

    def _also_moved(self, ids: I64) -> I64:
        """Return `ids` and all that were ever moved, ascending."""
        return distinct(np.concatenate([ids, self._moved]), len(self._vertices))

    def set_region(self, ids: I64 | None) -> None:
        """Tint the vertices `ids` as the region and draw their rim; None for no region.

        On a heavy form it is shown a moment later: of several while a hand moves, the last.
        """
        if _same(ids, self._region):
            return
        self._region = ids
        if self._heavy:
            self._region_timer.start()
        else:
            self._show_region()

    def _show_region(self) -> None:
        """Show the region that was asked for last."""
        self._region_timer.stop()
        ids = self._region
        if ids is not None and (self._heavy or len(ids) > MANY):
            self.aside.ask("region", lambda: self.scene.marked(ids), self._take_region)
        else:
            self.aside.drop("region")
            self._take_region(None)

    def _take_region(self, marked: Marked | None) -> None:
        self.scene.set_region(self._region, marked)
        self.update()

    def render_image(self, size: tuple[int, int], transparent: bool = False) -> QImage:
        """Return the form as a picture of `size` device pixels, smooth, without ink over it."""
        for timer, show in (
            (self._region_timer, self._show_region),
            (self._plane_timer, self._show_plane),
        ):
            if timer.isActive():
                show()
        if self.aside.wants("region"):
            self.aside.drop("region")
            self._take_region(None)
        return super().render_image(size, transparent)

    def set_colours(self, colours: ArrayLike | None) -> None:
        """Colour every vertex, (n, 3) uint8, instead of clay and region; None for clay."""
        self.scene.set_map(None if colours is None else np.asarray(colours, dtype=np.uint8))
        self.update()

    def ghost(
        self,
        positions: ArrayLike | None,
        apart: I64 | None = None,
        plain: Plain | None = None,
    ) -> None:
        """Show other positions (n, 3) of the same mesh, translucent, where they differ.

        Parameters
        ----------
        apart : the vertices where they may differ; None for any.
        plain : ids of a region and its base (r, 3), from which the features rise that are shown.
        """
        if positions is None:
            self._ghost_of = None
        else:
            self._ghost_of = positions, apart, plain
        surface = self.scene.surface
        if (
            self._ghost_of is not None
            and surface is not None
            and (self._heavy or _many(apart, surface.n))
        ):
            self._ghost_aside(self._ghost_of)
            return
        self.aside.drop("ghost")
        if self.scene.set_ghost(positions, apart, plain):
            self.update()

    def _ghost_again(self, ids: I64) -> None:
        """Let the ghost follow a form that was brought, elsewhere at the vertices `ids`."""
        if self._ghost_of is not None:
            positions, apart, plain = self._ghost_of
            if apart is not None:
                apart = distinct(np.concatenate([apart, ids]), len(self._vertices))
            self.ghost(positions, apart, plain)

    def _ghost_aside(self, of: GhostOf) -> None:
        surface, scene = self.scene.surface, self.scene
        assert surface is not None

        def work() -> tuple[object, Made]:
            return surface.stamp, scene.made_ghost(*of)

        def take(made: tuple[object, Made]) -> None:
            stamp, ghost = made
            if stamp != surface.stamp:
                # The form moved meanwhile.
                apart = of[1] if of[1] is None else self._also_moved(of[1])
                self._ghost_aside((of[0], apart, of[2]))
            elif scene.take_ghost(ghost):
                self.update()

        self.aside.ask("ghost", work, take)

    def set_pins(self, points: ArrayLike | None) -> None:
        """Show pins at `points` (p, 3); None for no pins."""
        if self.scene.set_pins(points):
            self.update()

    def set_plane(self, plane: ArrayLike | None) -> None:
        """Show where a plane of symmetry a, b, c, d cuts the form; None for none."""
        self._plane = plane
        self._sheet = False
        if self._heavy:
            self._plane_timer.start()
        else:
            self._show_plane()

    def _show_plane(self) -> None:
        """Show the plane that was asked for last."""
        self._plane_timer.stop()
        self.scene.set_plane(self._plane)
        self.scene.show_sheet(self._sheet)
        self.update()

    def show_sheet(self, wanted: bool) -> None:
        """Show that plane as a translucent sheet as well, or not."""
        self._sheet = wanted
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
        if role in ("target", "guide"):
            p = np.atleast_2d(np.asarray(points, dtype=np.float64))
            if self.scene.hide_curve(name):
                self.update()
            self.overlay.set_curve(name, SpaceCurve(p, role, closed, label))
            self.overlay.follow(self.view())
        else:
            self.overlay.set_curve(name, None)
            if self.scene.show_curve(name, points, role, closed, anchors):
                self.update()

    def hide_curve(self, name: str) -> None:
        """Take the curve of that name away, if there is one."""
        self.overlay.set_curve(name, None)
        if self.scene.hide_curve(name):
            self.update()

    def set_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.scene.set_theme(theme)
        self.overlay.set_theme(theme)
        self.cube.set_theme(theme)
        self.update()

    @property
    def display(self) -> Display:
        """What the form is coloured by: clay, zebra, reflection, curvature or deviation."""
        return self.maps.display

    def set_display(self, display: Display) -> None:
        """Colour the form by clay, by stripes that it reflects, or by a map with its scale."""
        self.maps.show(display)
        self.update()
        self.looks_changed.emit()

    @property
    def stripes(self) -> Stripes:
        """The stripes that zebra and reflection lines are made of."""
        return self.maps.stripes

    def set_stripes(self, stripes: Stripes) -> None:
        """Reflect other stripes."""
        if stripes != self.maps.stripes:
            self.maps.stripes = stripes
            self.set_display(self.display)

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


def _many(ids: I64 | None, n: int) -> bool:
    """Whether so many of `n` vertices, None for all, are too many to look at in a moment."""
    return (n if ids is None else len(ids)) > MANY


def _same(ids: I64 | None, others: I64 | None) -> bool:
    """Whether two regions are the same, or both are none."""
    if ids is None or others is None:
        return ids is others
    return ids is others or np.array_equal(ids, others)
