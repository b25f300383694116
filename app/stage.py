"""Stage: puts what the session knows onto the viewport, and lets the form flow where it should."""

from __future__ import annotations

import time

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from app.form import Form
from app.session import Session
from app.viewport import Viewport
from app.viewport.around import differing
from app.viewport.aside import MANY
from engine import Document, Draft, Mesh, Source, Stroke, View, source_curve
from engine.arrays import F64, I64, distinct
from plugins.api import Pointer

FLOW_SECONDS = 0.2
FRAME_MS = 15
_NONE: I64 = np.zeros(0, dtype=np.int64)


class Stage(QObject):
    """Keeps the viewport in step with the session.

    Signals
    -------
    settled : nothing moves by itself any more; what is shown is what the session says.
    base_shown(on) : the base of the region is looked at alone, or no longer.
    """

    settled = Signal()
    base_shown = Signal(bool)

    def __init__(self, session: Session, viewport: Viewport, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._viewport = viewport
        # On screen is this mesh, apart from some vertices that may be anywhere.
        self._mesh: Mesh | None = None
        self._apart: I64 = _NONE
        self._way: I64 = _NONE
        self._flowing: tuple[Form, I64, F64, F64] | None = None  # whereto, and what moves from, to
        self._began = 0.0
        self._coming: Form | None = None  # the viewport makes it ready
        self._original = False
        self._base_of: Draft | None = None
        self._paused = False
        self._curves: set[str] = set()
        self._roi: object = None
        self._plane: tuple[float, ...] | None = None
        self._plane_pointed = False
        self._ghost_of: tuple[Mesh | None, F64 | None] = (None, None)  # and the base
        self._clock = QTimer(self)
        self._clock.setInterval(FRAME_MS)
        self._clock.timeout.connect(self._frame)
        session.opened.connect(self._opened)
        session.shown_changed.connect(self._shown)
        viewport.pointer.connect(self._pointed)
        viewport.brought.connect(self._brought)

    @property
    def flowing(self) -> bool:
        """Whether the form is on its way."""
        return self._clock.isActive() or self._coming is not None

    def show_original(self, on: bool) -> None:
        """Show the form as it was opened, as long as `on`."""
        document = self._session.document
        if document is None or on == self._original:
            return
        self._original = on
        self._stop()
        self._shown(False)

    @property
    def base_alone(self) -> bool:
        """Whether the base of the region is shown, whatever the level."""
        return self._base_of is not None

    def show_base(self, on: bool) -> None:
        """Show the base of the region alone until something else is done; the level stays."""
        document = self._session.document
        if document is None or document.draft.roi is None:
            on = False
        if on == self.base_alone:
            return
        self._base_of = document.draft if on and document is not None else None
        self._shown(False)
        self.base_shown.emit(on)

    def pause(self, on: bool) -> None:
        """Leave the viewport to somebody else, or put on it again what the session says."""
        self._paused = on
        self._stop()
        if not on and self._mesh is not None:
            # Wherever somebody else has put the vertices.
            self._apart = differing(self._viewport.vertices, self._mesh.vertices)
            self._shown(False)

    def stop(self) -> None:
        """End what moves by itself, for closing."""
        self._clock.stop()

    def _opened(self) -> None:
        document = self._session.document
        assert document is not None
        self._stop()
        self._original = False
        self._leave_base()
        self._plane = None
        self._curves.clear()
        self._viewport.set_mesh(document.mesh)
        self._take_mesh(document.mesh)

    def _take_mesh(self, mesh: Mesh) -> None:
        """Note that the viewport has another mesh, and nothing on it."""
        self._mesh, self._apart = mesh, _NONE
        self._roi = self._plane = None
        self._ghost_of = (None, None)

    def _shown(self, flowing: bool) -> None:
        form, document = self._session.form, self._session.document
        if form is None or document is None or self._mesh is None or self._paused:
            return
        if form.mesh.faces is not self._mesh.faces:
            self._viewport.set_mesh(form.whole, keep_camera=True)
            self._take_mesh(form.whole)
        if document.mesh.faces is form.mesh.faces:
            self._mark(document)
        if self._original and document.original.faces is form.mesh.faces:
            form = Form(document.original)
        elif self.base_alone:
            form = self._base(document) or form
        if flowing and not self._original:
            self._flow(form)
            self._draw_curves(document)
        else:
            self._stop()
            self._draw(form)

    def _base(self, document: Document) -> Form | None:
        """Return the mesh with the base in the region, once it is known."""
        known = self._session.decomposition
        return None if known is None else Form(document.mesh, known.roi, known.base)

    def _leave_base(self) -> None:
        """Let the next thing shown be the session's."""
        if self.base_alone:
            self._base_of = None
            self.base_shown.emit(False)

    def _pointed(self, pointer: Pointer) -> None:
        if pointer.kind == "press":
            self.show_base(False)

    # ---- moving to a form

    def _draw(self, form: Form) -> None:
        """Put a form on screen: at once, or when it is ready if much of it is elsewhere."""
        ids = self._way_to(form)
        if len(ids) > MANY:
            self._coming = form
            self._viewport.bring(form, ids)
            return
        self._put(form.at(ids), ids)
        self._mesh, self._apart = form.mesh, form.ids
        self._settle()

    def _brought(self) -> None:
        """A form that was made ready is on screen."""
        if self._coming is not None:
            form, self._coming = self._coming, None
            self._mesh, self._apart = form.mesh, form.ids
            self._settle()

    def _flow(self, form: Form) -> None:
        """Let a form be seen to come; one that is not ready in a moment is there at once."""
        self._stop()
        ids = self._way_to(form)
        if len(ids) > MANY:
            self._draw(form)
            return
        self._flowing = (form, ids, self._viewport.vertices[ids], form.at(ids))
        self._mesh, self._apart = form.mesh, ids
        self._began = time.monotonic()
        self._clock.start()

    def _frame(self) -> None:
        assert self._flowing is not None
        form, ids, before, after = self._flowing
        share = min((time.monotonic() - self._began) / FLOW_SECONDS, 1.0)
        eased = share * share * (3 - 2 * share)
        if share >= 1.0:
            self._stop()
            self._draw(form)
        else:
            self._put(before + eased * (after - before), ids)

    def _stop(self) -> None:
        self._clock.stop()
        self._flowing = None
        if self._coming is not None:
            self._coming = None
            self._viewport.keep()

    def _way_to(self, form: Form) -> I64:
        """Return the vertices that may be elsewhere on screen than in a form, ascending.

        The same array again and again spares the viewport its preparation.
        """
        assert self._mesh is not None
        parts = [self._apart, form.ids]
        if form.mesh is not self._mesh:
            parts.append(differing(form.mesh.vertices, self._mesh.vertices))
        longest = max(parts, key=len)
        if all(len(part) == 0 or np.array_equal(part, longest) for part in parts):
            way = longest
        else:
            way = distinct(np.concatenate(parts), form.mesh.n)
        if not np.array_equal(way, self._way):
            self._way = way
        return self._way

    def _put(self, places: F64, ids: I64) -> None:
        """Move vertices on screen, if they are not there already."""
        if not np.array_equal(places, self._viewport.vertices[ids]):
            self._viewport.set_vertices(places, ids)

    def _settle(self) -> None:
        document = self._session.subject
        if document is None:
            return
        self._ghost(document)
        self._draw_curves(document)
        self.settled.emit()

    def _ghost(self, document: Document) -> None:
        lying = document.draft.roi is not None and not self._original and not self.base_alone
        lying = lying and not self._session.rests_on_details
        wanted = document.mesh if lying else None
        known = self._session.decomposition if lying else None
        of = wanted, None if known is None else known.base
        if any(now is not before for now, before in zip(of, self._ghost_of, strict=True)):
            self._ghost_of = of
            apart = self._apart if wanted is self._mesh else None
            plain = None if known is None else (known.roi, known.base)
            self._viewport.ghost(None if wanted is None else wanted.vertices, apart, plain)

    def _mark(self, document: Document) -> None:
        """Show the region and the plane of the current document."""
        if document.draft is not self._base_of:
            self._leave_base()
        if document.draft.roi is not self._roi:
            self._roi = document.draft.roi
            self._viewport.set_region(document.draft.roi)
        self._mark_plane(document)

    def point_out_plane(self, on: bool) -> None:
        """Show the plane of symmetry as a sheet, as long as `on`."""
        self._plane_pointed = on
        if self._session.document is not None:
            self._mark_plane(self._session.document)

    def _mark_plane(self, document: Document) -> None:
        """The plane is a line around the form; a sheet too while its two sides are settled."""
        plane = document.draft.options.mirror or None
        if plane != self._plane:
            self._plane = plane
            self._viewport.set_plane(plane)
        if plane is not None:
            self._viewport.show_sheet(self._plane_pointed or document.draft.roi is None)

    def _draw_curves(self, document: Document) -> None:
        if self._mesh is None:
            return
        draft, drawn = document.draft, self._viewport.vertices
        wanted: set[str] = set()
        marked = not self._original and not self.base_alone
        if marked:
            if draft.source is not None:
                source = draft.source
                self._draw_source("source", source)
                wanted.add("source")
            for i, stroke in enumerate(draft.strokes):
                if stroke.hidden:
                    continue
                self._draw_source(f"source {i}", stroke)
                points = on_picture_plane(stroke, drawn[stroke.anchors])
                self._viewport.show_curve(f"target {i}", points, "target", closed=stroke.closed)
                wanted |= {f"source {i}", f"target {i}"}
        pins = np.array(draft.options.pins, dtype=np.int64)
        # Those of another region do nothing in this one.
        if len(pins):
            pins = pins[np.isin(pins, draft.roi)] if draft.roi is not None and marked else pins[:0]
        self._viewport.set_pins(drawn[pins] if len(pins) else None)
        for name in self._curves - wanted:
            self._viewport.hide_curve(name)
        self._curves = wanted

    def _draw_source(self, name: str, curve: Source | Stroke) -> None:
        """Draw the smooth curve that the anchors zigzag around, and the anchors as dots."""
        anchors = self._viewport.vertices[curve.anchors]
        smooth = source_curve(anchors, curve.closed)
        self._viewport.show_curve(name, smooth, "source", curve.closed, anchors)


def _levelled(values: F64, closed: bool) -> F64:
    """Return values (c, p) along a curve without what changes from one point to the next."""
    # Of a short curve a share: more would take its own way in depth off it.
    reach = min(6, len(values) // 10)
    if reach < 1:
        return values
    weights = np.hanning(2 * reach + 3)[1:-1]
    around = ((reach, reach), (0, 0))
    padded = (
        np.pad(values, around, mode="wrap")
        if closed
        else np.pad(values, around, mode="reflect", reflect_type="odd")
    )
    columns = [np.convolve(column, weights / weights.sum(), "valid") for column in padded.T]
    return np.stack(columns, axis=1)


def on_picture_plane(stroke: Stroke, anchors: F64) -> F64:
    """Return the target as points in space, (c, 3): below its pixels, as deep as the anchors are.

    Seen through `stroke.view` they cover the target; seen from elsewhere they show how far the
    curve lies from the surface. Anchors zigzag around the curve and so do their targets: the line
    drawn is the smooth one between them.
    """
    target = source_curve(stroke.target, stroke.closed)
    view: View = stroke.view
    homogeneous = np.column_stack([anchors, np.ones(len(anchors))]) @ view.matrix.T
    # The anchors zigzag along the curve; the line between them does not.
    homogeneous = _levelled(homogeneous, stroke.closed)
    width, height = view.size
    w = homogeneous[:, 3]
    clip = np.column_stack(
        [
            (2 * target[:, 0] / width - 1) * w,
            (1 - 2 * target[:, 1] / height) * w,
            homogeneous[:, 2],
            w,
        ]
    )
    points = np.linalg.solve(view.matrix, clip.T).T
    return np.asarray(points[:, :3] / points[:, 3:])
