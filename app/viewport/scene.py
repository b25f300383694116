"""What is in the picture: the form, its region, curves on it, the ghost of the original."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from app.look import DARK, RIM, Theme, rgb, rgb8
from app.viewport.camera import Eye
from app.viewport.curves import Isoline, Segments
from app.viewport.ghost import Drawing, Ghost, Plain
from app.viewport.heavy import Own, heavy, is_heavy
from app.viewport.lights import background, clay, light_up
from app.viewport.marks import Marks
from app.viewport.pieces import Pieces
from app.viewport.plane import PlaneMark
from app.viewport.standin import StandIn, with_kept
from app.viewport.surface import Moved, Placement, Surface
from app.viewport.tint import Feather, changed, feathered, tinted
from engine.arrays import F64, I64, frozen
from engine.mesh import Mesh

_KEPT = 60_000  # vertices of the region that a stand-in may keep as they are
Made = tuple[Ghost, Drawing | None]
Parts = tuple[I64, I64]  # vertices (c,), and faces (g, 3) in positions of these
Marked = tuple[Feather, Parts | None]
_NO_IDS: I64 = np.zeros(0, dtype=np.int64)
RIM_WIDTH = 2.5  # logical pixels
MANY = 4  # a share of the vertices above which painting all of them is quicker


class Scene:
    """All that the viewport's renderer draws.

    Parameters
    ----------
    renderer : the vtkRenderer to fill.
    """

    def __init__(self, renderer: vtkRenderer, theme: Theme = DARK) -> None:
        self.renderer = renderer
        self.theme = theme
        self.scale = 1.0
        self.wireframe = False
        self.placement = Placement(np.zeros(3), 1.0)
        self.surface: Surface | None = None
        self.stand_in: StandIn | None = None
        self.pieces: Pieces | None = None
        self._mesh: Mesh | None = None
        self._faces: I64 = np.zeros((0, 3), dtype=np.int64)
        self._region: I64 | None = None
        self._tint: Feather | None = None
        self._lighter: Parts | None = None  # what stands in for it
        self._rim: tuple[Isoline, Segments] | None = None
        self._map: NDArray[np.uint8] | None = None
        self._ghost: Ghost | None = None
        self.plane: PlaneMark | None = None
        self.marks = Marks(renderer)
        light_up(renderer)
        background(renderer, theme)

    def set_theme(self, theme: Theme) -> None:
        """Take the colours of another theme."""
        self.theme = theme
        background(self.renderer, theme)
        self.set_wireframe(self.wireframe)
        self._paint()

    def set_mesh(self, mesh: Mesh, own: Own | None = None) -> None:
        """Show another form; everything that lay on the old one goes.

        Parameters
        ----------
        own : arrays of a heavy one, if they were made already.
        """
        self.clear()
        self.placement = Placement.of(mesh)
        self._mesh = mesh
        self._faces = mesh.faces
        self.surface = Surface(
            self.placement.to_scene(mesh.vertices) if own is None else own.positions,
            mesh.faces,
            rgb8(self.theme.clay),
            None if own is None else own.normals,
            mesh.topology.incidence,
            heavy(mesh).offsets if is_heavy(mesh) else None,
        )
        clay(self.surface.actor.GetProperty())
        self.set_wireframe(self.wireframe)
        self.renderer.AddActor(self.surface.actor)

    def clear(self) -> None:
        """Take everything out of the picture."""
        self._forget_region()
        self.set_ghost(None)
        self.marks.clear()
        self.set_plane(None)
        for drawn in (self.surface, None if self.stand_in is None else self.stand_in.surface):
            if drawn is not None:
                self.renderer.RemoveActor(drawn.actor)
        if self.pieces is not None:
            self.pieces.remove()
        self.surface = self.stand_in = self.pieces = self._mesh = None
        self._map = None

    def move(self, positions: NDArray[Any], ids: I64 | None) -> None:
        """Move all vertices, or those of `ids`, to `positions` in mesh units."""
        assert self.surface is not None
        ring = self.surface.move(self.placement.to_scene(positions), ids)
        self._follow(ring)
        if self._ghost is not None:
            self._ghost.follow(np.arange(self.surface.n) if ids is None else ids)

    def take(self, made: Moved) -> None:
        """Take what `surface.moved_to` made; the ghost stays as it is."""
        assert self.surface is not None
        self.surface.take(made)
        self._follow(made.about.ring)

    def _follow(self, ring: I64 | None) -> None:
        """Let what lies on the form follow it at the vertices `ring`, None for all."""
        assert self.surface is not None
        if self._rim is not None:
            line, marks = self._rim
            marks.move(line.points(self.surface.positions))
        if self.plane is not None:
            self.plane.follow(self.surface.positions)
        if self.stand_in is not None and self.standing_in:
            if ring is None:
                self.stand_in.follow()
            else:
                self.stand_in.follow_at(ring)

    # What is coloured

    def set_region(self, ids: I64 | None, marked: Marked | None = None) -> None:
        """Tint the region `ids` and draw its rim; None for no region.

        Parameters
        ----------
        marked : what the method of that name gives, if it is known already.
        """
        before = self._tint
        self._forget_region()
        if self.surface is None or self._mesh is None:
            return
        self._region = ids
        if ids is not None and len(ids):
            self._tint, self._lighter = self.marked(ids) if marked is None else marked
            self._draw_rim(self._tint)
        shown = self._put_stand_in_away()
        tint, other = self._tint, None
        if before is not None and tint is not None and self._map is None:
            other = changed(before, tint)
        if tint is None or other is None or MANY * len(other) > self.surface.n:
            self._paint()
        else:
            self._paint_at(tint, other)
        self.use_stand_in(shown)

    def marked(self, ids: I64) -> Marked:
        """Return the tint of a region, and vertices and faces of the lighter form that keeps it.

        In any thread; there is no lighter form of one that is not heavy.
        """
        assert self._mesh is not None
        topology = self._mesh.topology
        tint = feathered(ids, topology.faces, topology.incidence, topology.n)
        return tint, self._lightened(ids) if is_heavy(self._mesh) else None

    def _lightened(self, kept: I64) -> Parts:
        assert self._mesh is not None
        few = kept if len(kept) <= _KEPT else None
        incidence = self._mesh.topology.incidence
        return with_kept(heavy(self._mesh).lighter, self._mesh.faces, incidence, few)

    def _forget_region(self) -> None:
        if self._rim is not None:
            self.renderer.RemoveActor(self._rim[1].actor)
        self._rim = self._region = self._tint = self._lighter = None

    def _put_stand_in_away(self) -> bool:
        """Forget the stand-in, which shows another region as it is; return whether it was shown."""
        shown = self.standing_in
        if self.stand_in is not None:
            self.renderer.RemoveActor(self.stand_in.surface.actor)
        self.stand_in = None
        return shown

    def _draw_rim(self, tint: Feather) -> None:
        """Draw the line where the feathered weight is one half: the border without its teeth."""
        assert self.surface is not None
        line = Isoline(tint.weight, tint.faces)
        if len(line) == 0:
            return
        marks = Segments(RIM, RIM_WIDTH * self.scale, line.points(self.surface.positions))
        self.renderer.AddActor(marks.actor)
        self._rim = (line, marks)

    def set_map(self, colours: NDArray[np.uint8] | None) -> None:
        """Colour every vertex (n, 3) uint8 instead of clay and region; None for clay again."""
        self._map = colours
        self._paint()

    def recolour_map(self, colours: NDArray[np.uint8], ids: I64) -> None:
        """Give the vertices `ids` other colours (m, 3) in the map that is shown."""
        assert self._map is not None
        assert self.surface is not None
        self._map[ids] = colours
        self.surface.recolour(colours, ids)
        if self.stand_in is not None and self.standing_in:
            self.stand_in.recolour()

    def set_wireframe(self, wanted: bool) -> None:
        """Draw the edges of the triangles over the form, or not."""
        self.wireframe = wanted
        if self.surface is not None:
            look = self.surface.actor.GetProperty()
            look.SetEdgeVisibility(wanted)
            look.SetEdgeColor(*rgb(self.theme.edge))
            look.SetEdgeOpacity(0.55)
            look.SetLineWidth(1.0 * self.scale)

    def _paint(self) -> None:
        if self.surface is None:
            return
        if self._map is not None:
            self.surface.recolour(self._map)
        elif self._tint is None:
            self.surface.recolour(np.asarray(rgb8(self.theme.clay), dtype=np.uint8))
        else:
            tint, colours = self._tint, self.surface.colours
            held, full = tinted(np.array([0.0, 1.0], dtype=np.float32), self.theme)
            for k in range(3):
                colours[:, k] = np.where(tint.inside, full[k], held[k])
            self._paint_at(tint, tint.border)
        if self.stand_in is not None and self.standing_in:
            self.stand_in.recolour()

    def _paint_at(self, tint: Feather, ids: I64) -> None:
        """Give the vertices `ids` the colours of a region."""
        assert self.surface is not None
        self.surface.recolour(tinted(tint.weight[ids], self.theme), ids)

    # What lies over the form

    @property
    def ghost(self) -> Surface | None:
        """The part of the original that is seen, if any is."""
        return None if self._ghost is None else self._ghost.drawn

    def set_ghost(
        self,
        positions: ArrayLike | None,
        apart: I64 | None = None,
        plain: Plain | None = None,
    ) -> bool:
        """Show the original (n, 3), translucent, wherever it differs from what is shown.

        Parameters
        ----------
        apart : the vertices that may be elsewhere than in the original; None for any.
        plain : ids of a region and its base (r, 3), from which the features rise that are shown.

        Returns whether the picture is another now.
        """
        if positions is None or self.surface is None or self._mesh is None:
            return self._put_ghost(None)
        return self.take_ghost(self.made_ghost(positions, apart, plain))

    def made_ghost(
        self, positions: ArrayLike, apart: I64 | None = None, plain: Plain | None = None
    ) -> Made:
        """Return the ghost of the form as it is now, and what is apart of it; in any thread."""
        assert self.surface is not None
        assert self._mesh is not None
        original = frozen(positions, np.float64)
        ghost = Ghost(
            self.renderer, self.surface, self._mesh.topology, self.placement, original, plain
        )
        return ghost, ghost.compared(np.arange(self.surface.n) if apart is None else apart)

    def take_ghost(self, made: Made) -> bool:
        """Show what `made_ghost` gave; return whether the picture is another now."""
        ghost, drawing = made
        another = self._put_ghost(ghost)
        ghost.show(drawing)
        return another or ghost.seen

    def _put_ghost(self, ghost: Ghost | None) -> bool:
        """Put another ghost in the place of the one there was; return whether that was seen."""
        before, self._ghost = self._ghost, ghost
        seen = before is not None and before.seen
        if before is not None:
            before.remove()
        return seen

    def show_curve(
        self,
        name: str,
        points: ArrayLike,
        role: str,
        closed: bool = False,
        anchors: ArrayLike | None = None,
    ) -> bool:
        """Draw a curve (p, 3), mesh units, under a name; return whether the picture is another.

        Parameters
        ----------
        anchors : (a, 3) the points shown as dots, or None for those of the curve.
        """
        given = self._placed(points)
        return self.marks.show_curve(
            name, given, role, closed, given if anchors is None else self._placed(anchors)
        )

    def hide_curve(self, name: str) -> bool:
        """Take the curve of that name away; return whether there was one."""
        return self.marks.hide_curve(name)

    def set_pins(self, points: ArrayLike | None) -> bool:
        """Show pins at `points` (p, 3), mesh units; return whether the picture is another."""
        some = points is not None and len(np.asarray(points)) > 0
        return self.marks.set_pins(self._placed(points) if some and points is not None else None)

    def _placed(self, points: ArrayLike) -> F64:
        return self.placement.to_scene(np.atleast_2d(np.asarray(points, dtype=np.float64)))

    def set_plane(self, plane: ArrayLike | None) -> None:
        """Show where the plane a, b, c, d (a x + b y + c z = d, mesh units) cuts; None for none."""
        for actor in (self.plane.line, self.plane.sheet) if self.plane is not None else ():
            self.renderer.RemoveActor(actor)
        self.plane = None
        if plane is None or self.surface is None:
            return
        a = np.asarray(plane, dtype=np.float64)
        normal = a[:3] / np.linalg.norm(a[:3])
        d = a[3] / np.linalg.norm(a[:3]) - self.placement.centre @ normal
        there = np.append(normal, self.placement.scale * d)
        self.plane = PlaneMark(there, self.surface.positions, self._faces, self.theme, self.scale)
        self.plane.sheet.VisibilityOff()
        for actor in (self.plane.line, self.plane.sheet):
            self.renderer.AddActor(actor)

    def show_sheet(self, wanted: bool) -> None:
        """Show the plane as a sheet of glass as well as where it cuts, or not."""
        if self.plane is not None:
            self.plane.sheet.SetVisibility(wanted)

    def seen_from(self, eye: Eye, height: float) -> None:
        """Give curves and pins their thickness as seen from `eye`, `height` logical pixels high."""
        self.marks.seen_from(eye, height)

    # A lighter picture while it moves

    def use_stand_in(self, wanted: bool) -> None:
        """Draw the lighter form instead of the form itself, or the form again."""
        if self.surface is None:
            return
        if wanted and self.stand_in is None:
            assert self._mesh is not None
            kept = self._region if self._region is not None else _NO_IDS
            ids, faces = self._lighter or self._lightened(kept)
            self.stand_in = StandIn(self.surface, ids, faces)
            self.stand_in.surface.actor.SetProperty(self.surface.actor.GetProperty())
            self.stand_in.surface.actor.SetShaderProperty(self.surface.actor.GetShaderProperty())
            self.renderer.AddActor(self.stand_in.surface.actor)
        elif wanted and self.stand_in is not None and not self.standing_in:
            self.stand_in.follow()
        if self.stand_in is None:
            return
        self.stand_in.surface.actor.SetVisibility(wanted)
        self.surface.actor.SetVisibility(not wanted and self.pieces is None)

    def draw_in_pieces(self) -> None:
        """Draw the form itself never as a whole: the stand-in, and its pieces in idle moments."""
        if self.pieces is None and self.surface is not None and self._mesh is not None:
            self.pieces = Pieces(self.renderer, self.surface, heavy(self._mesh))
            self.use_stand_in(True)

    @contextmanager
    def whole(self) -> Iterator[None]:
        """Draw the form itself at once, however long that takes."""
        standing_in = self.standing_in
        self.use_stand_in(False)
        if self.pieces is not None:
            self.pieces.show(range(len(self.pieces)))
        try:
            yield
        finally:
            if self.pieces is not None:
                self.pieces.show(range(0))
            self.use_stand_in(standing_in)

    @property
    def standing_in(self) -> bool:
        """Whether the lighter form is shown."""
        return self.stand_in is not None and bool(self.stand_in.surface.actor.GetVisibility())

    @property
    def radius(self) -> float:
        """Radius about the scene's origin of a ball that holds everything drawn."""
        reach = [1.0, 0.0 if self.surface is None else self.surface.reach]
        reach += [0.0 if self._ghost is None else self._ghost.reach]
        reach.append(self.marks.reach)
        return 1.05 * 3**0.5 * max(reach)
