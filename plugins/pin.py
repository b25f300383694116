"""Pin: points of the region that an edit leaves where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plugins.api import Context, Document, EngineError, Gesture, Pointer, Tool

NEAR = 12.0  # px: a press this near to a pin takes it out


class Pin(Tool):
    """Sets a pin where one presses, or takes one out."""

    id = "pin"
    title = "Pin"
    tip = "Press on the region to pin a point; press a pin to take it out"
    icon = "mdi6.pin-outline"
    shortcut = "N"
    label = "Pin"
    order = 50

    def available(self, document: Document) -> bool:
        """A pin holds a point of a region."""
        return document.draft.roi is not None

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Act on the release, so that Escape can still call it off."""
        pressed = pointer
        while pointer.kind != "release":
            pointer = yield
        document = context.document
        draft = document.draft
        pins = draft.options.pins
        held = _nearest(context, pressed, pins)
        if held is not None:
            kept = tuple(pin for pin in pins if pin != held)
        else:
            hit = context.pick(pressed.x, pressed.y)
            if hit is None or draft.roi is None or hit.vertex not in draft.roi:
                raise EngineError("A pin holds a point of the region. Press on the coloured part.")
            kept = (*pins, hit.vertex)
        return document.with_draft(replace(draft, options=replace(draft.options, pins=kept)))


def _nearest(context: Context, pointer: Pointer, pins: tuple[int, ...]) -> int | None:
    """Return the pin under the pointer, if there is one."""
    if not pins:
        return None
    seen = context.view.project(context.shown.vertices[list(pins)])
    away = np.linalg.norm(seen - np.array(pointer.xy), axis=1)
    nearest = int(away.argmin())
    return pins[nearest] if away[nearest] <= NEAR else None
