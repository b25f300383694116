"""Pin: a click on the region holds a vertex where it is; a click on a pin lets it go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plugins.api import I64, Context, Document, EngineError, Gesture, Pointer, Tool

GRAB = 12.0  # px: a click this near to a pin means the pin


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
            return "Choose a region first: press L and circle the part you want to reshape"
        if len(_pins(document)):
            return "Click to pin another point, or click on a pin to let it go"
        return self.tip

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Pin or unpin what is under the press when the button is let go."""
        press = pointer
        while pointer.kind != "release":
            pointer = yield
        document = context.document
        draft = document.draft
        if draft.roi is None:
            raise EngineError("There is no region to pin. Press L and circle a part first.")
        pins = set(draft.options.pins)
        held = _pin_near(context, press)
        if held is not None:
            pins.remove(held)
        else:
            pins.add(_vertex_under(context, press))
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


def _vertex_under(context: Context, press: Pointer) -> int:
    hit, roi = context.pick(press.x, press.y), context.document.draft.roi
    if hit is None or roi is None or hit.vertex not in roi:
        raise EngineError("That point is not on the region. Click on the coloured part.")
    return hit.vertex
