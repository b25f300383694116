"""Measure: the straight distance between two points of the surface."""

from __future__ import annotations

import numpy as np

from plugins.api import Context, EngineError, Gesture, Pointer, Tool, figure


class Measure(Tool):
    """Shows the distance between where a drag begins and where it ends."""

    id = "measure"
    title = "Measure"
    tip = "Drag from one point of the form to another to measure between them"
    icon = "mdi6.ruler"
    shortcut = "M"
    order = 200

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Measure while the hand moves."""
        first = context.pick(*pointer.xy)
        if first is None:
            raise EngineError("There is no surface there. Begin on the form.")
        while pointer.kind != "release":
            pointer = yield
            last = context.pick(*pointer.xy)
            if last is None:
                continue
            length = float(np.linalg.norm(last.point - first.point))
            text = f"{figure(length)} {context.document.unit}"
            context.span(first.point, last.point, text)
            context.say(text)
        return None
