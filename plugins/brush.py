"""Brush: paint the region; Ctrl or the eraser end takes away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from plugins.api import F64, I64, Context, Document, EngineError, Gesture, Pointer, Tool, option


@dataclass(frozen=True)
class BrushOptions:
    """How wide the brush is and what it takes."""

    radius: float = option(24.0, "Radius", low=2.0, high=300.0, step=2.0, unit="px", decimals=0)
    pressure: bool = option(True, "Pen pressure", "A lighter pen paints narrower")
    through: bool = option(False, "Through", "Take hidden vertices behind the surface as well")


class Brush(Tool):
    """Paints the region stroke by stroke; it stays in hand until another tool is chosen."""

    id = "brush"
    title = "Brush"
    tip = "Paint the part you want to reshape"
    icon = "mdi6.brush"
    shortcut = "P"
    label = "Region painted"
    order = 20
    sized = "radius"
    Options = BrushOptions

    def hint(self, document: Document) -> str:
        """Say what the brush does now."""
        if document.draft.roi is None:
            return f"{self.tip}; a drag with Alt sizes the brush"
        return "Paint to add, hold Ctrl to take away, then {tool.source} to draw a source curve"

    def circle(self, options: Any) -> float | None:
        """The brush is as wide as it is shown."""
        return float(options.radius)

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Gather what the brush passes over; the region grows under it."""
        document = context.document
        takes = pointer.ctrl or pointer.eraser
        inside = np.zeros(document.mesh.n, dtype=bool)
        if document.draft.roi is not None:
            inside[document.draft.roi] = True
        before, touched = np.array(pointer.xy), 0
        while True:
            now = np.array(pointer.xy)
            for place in _on_the_way(before, now, 0.5 * context.options.radius):
                ids = _under(context, place, pointer)
                inside[ids] = not takes
                touched += len(ids)
            context.mark(np.flatnonzero(inside))
            if pointer.kind == "release":
                break
            before = now
            pointer = yield
        if touched == 0:
            raise EngineError("The brush touched nothing. Paint on a visible part of the form.")
        roi = np.flatnonzero(inside)
        return document.with_draft(document.draft.with_roi(roi if len(roi) else None))


def _on_the_way(before: F64, now: F64, step: float) -> F64:
    """Return places (p, 2) px from `before` to `now`, at most `step` px apart."""
    count = max(1, int(np.ceil(np.linalg.norm(now - before) / step)))
    return np.asarray(before + (now - before) * (np.arange(1, count + 1) / count)[:, None])


def _under(context: Context, place: F64, pointer: Pointer) -> I64:
    """Return ids of what lies under the brush at a place: at least the vertex next to its middle.

    On a coarse mesh there may be no vertex inside the circle.
    """
    options = context.options
    soft = options.pressure and pointer.pen
    share = float(np.sqrt(max(pointer.pressure, 0.05))) if soft else 1.0
    x, y = place
    near = context.vertices_near(x, y, share * options.radius, options.through)
    hit = None if len(near) else context.pick(x, y)
    return near if hit is None else np.array([hit.vertex], dtype=np.int64)
