"""Pin: a click on the region holds a vertex where it is; a pin can be dragged, or clicked away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plugins.api import I64, REGION_FIRST, Context, Document, EngineError, Gesture, Pointer, Tool

GRAB = 12.0  # px: a click this near to a pin means the pin
SLIP = 4.0  # px: a shorter drag is a click


class Pin(Tool):
    """Holds single vertices of the region."""

    id = "pin"
    title = "Pin"
    tip = "Click on the region to hold a point where it is"
    icon = "mdi6.pin-outline"
    shortcut = "N"
    label = "Pin"
    order = 50

    def available(self, document: Document) -> bool:
        """Pins hold parts of a region."""
        return document.draft.roi is not None

    def hint(self, document: Document) -> str:
        """Say what a click does now."""
        draft = document.draft
        if draft.roi is None:
            return REGION_FIRST
        if len(_pins(document)):
            return "Click to pin another point; drag a pin to move it, click on it to let it go"
        return self.tip

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Pin what is under the press, let go the pin there, or drag it to another place."""
        press = pointer
        if context.document.draft.roi is None:
            raise EngineError("There is no region. Press {tool.lasso} and circle a part first.")
        held = _pin_near(context, press)
        moved: Document | None = None
        while pointer.kind != "release":
            pointer = yield
            away = float(np.hypot(pointer.x - press.x, pointer.y - press.y))
            if held is None or (moved is None and away < SLIP):
                continue
            vertex = _vertex_at(context, pointer)
            if vertex is not None:  # beyond the region it stays at the last place on it
                moved = _with_pin(context.document, vertex, held)
                context.preview(moved)
        if held is None:
            return _with_pin(context.document, _vertex_under(context, press), None)
        return moved or _with_pin(context.document, None, held)


def _with_pin(document: Document, added: int | None, removed: int | None) -> Document:
    draft = document.draft
    pins = {pin for pin in (*draft.options.pins, added) if pin is not None and pin != removed}
    options = replace(draft.options, pins=tuple(sorted(pins)))
    return document.with_draft(replace(draft, options=options))


def _pin_near(context: Context, press: Pointer) -> int | None:
    """Return the visible pin next to the press, or None when there is none within reach."""
    pins = _pins(context.document)
    if len(pins) == 0:
        return None
    away = context.view.project(context.shown.vertices[pins]) - np.array(press.xy)
    distance = np.linalg.norm(away, axis=1)
    nearest = int(distance.argmin())
    if distance[nearest] > GRAB:
        return None
    seen = context.vertices_near(press.x, press.y, 2 * GRAB)
    return int(pins[nearest]) if pins[nearest] in seen else None


def _pins(document: Document) -> I64:
    """Return the pins that lie in the region; those of other regions do nothing here."""
    draft = document.draft
    pins = np.array(draft.options.pins, dtype=np.int64)
    return pins if draft.roi is None else pins[np.isin(pins, draft.roi)]


def _vertex_at(context: Context, pointer: Pointer) -> int | None:
    hit, roi = context.pick(pointer.x, pointer.y), context.document.draft.roi
    return None if hit is None or roi is None or hit.vertex not in roi else hit.vertex


def _vertex_under(context: Context, press: Pointer) -> int:
    vertex = _vertex_at(context, press)
    if vertex is None:
        raise EngineError("That point is not on the region. Click on the coloured part.")
    return vertex
