"""Brush: paint the region; Ctrl or the eraser end takes away."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from plugins.api import F64, I64, Context, Document, EngineError, Gesture, Pointer, Tool


@dataclass(frozen=True)
class BrushOptions:
    """How wide the brush is and what it takes."""

    radius: float = field(
        default=24.0,
        metadata={"label": "Radius", "min": 2.0, "max": 300.0, "step": 2.0, "unit": "px"},
    )
    pressure: bool = field(
        default=True, metadata={"label": "Pen pressure", "tip": "A lighter pen paints narrower"}
    )
    through: bool = field(
        default=False,
        metadata={"label": "Through", "tip": "Take hidden vertices behind the surface as well"},
    )


class Brush(Tool):
    """Paints the region stroke by stroke; it stays in hand until another tool is chosen."""

    id = "brush"
    title = "Brush"
    tip = "Paint the part you want to reshape"
    icon = "mdi6.brush"
    shortcut = "P"
    label = "Region painted"
    order = 20
    Options = BrushOptions

    def hint(self, document: Document) -> str:
        """Say what the brush does now."""
        if document.draft.roi is None:
            return self.tip
        return "Paint to add, hold Ctrl to take away, then S to draw a source curve"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Gather what the brush passes over."""
        takes = pointer.ctrl or pointer.eraser
        radius = context.options.radius
        touched = [self._under(context, pointer)]
        path = [pointer.xy]
        while pointer.kind != "release":
            pointer = yield
            touched += self._between(context, path[-1], pointer, radius)
            path.append(pointer.xy)
            context.draw(np.array(path), "guide" if takes else "region")
        caught = np.unique(np.concatenate(touched))
        document = context.document
        roi = document.draft.roi
        if len(caught) == 0:
            raise EngineError("The brush touched nothing. Paint on a visible part of the form.")
        if takes:
            left = np.setdiff1d(_none() if roi is None else roi, caught)
            return document.with_draft(document.draft.with_roi(left if len(left) else None))
        grown = caught if roi is None else np.union1d(roi, caught)
        return document.with_draft(document.draft.with_roi(grown))

    def _between(
        self, context: Context, before: tuple[float, float], pointer: Pointer, radius: float
    ) -> list[I64]:
        """What lies under the brush on the way to the pointer, half a radius a step."""
        a, b = np.array(before), np.array(pointer.xy)
        steps = max(1, int(np.ceil(np.linalg.norm(b - a) / (0.5 * radius))))
        places = a + (b - a) * (np.arange(1, steps + 1) / steps)[:, None]
        return [self._at(context, place, pointer) for place in places]

    def _under(self, context: Context, pointer: Pointer) -> I64:
        return self._at(context, np.array(pointer.xy), pointer)

    def _at(self, context: Context, place: F64, pointer: Pointer) -> I64:
        options = context.options
        share = np.sqrt(max(pointer.pressure, 0.05)) if options.pressure and pointer.pen else 1.0
        t = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        around = options.radius * share * np.column_stack([np.cos(t), np.sin(t)])
        return context.vertices_inside(place + around, options.through)


def _none() -> I64:
    return np.zeros(0, dtype=np.int64)
