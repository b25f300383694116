"""Navigate: strokes turn the view; for hands that have one button only."""

from __future__ import annotations

from plugins.api import Context, Gesture, Pointer, Tool


class Navigate(Tool):
    """Moves the camera by the main button or the pen's tip."""

    id = "navigate"
    title = "Navigate"
    tip = "Drag to turn the view, with Shift to pan, with Ctrl to zoom"
    icon = "mdi6.rotate-orbit"
    shortcut = "G"
    order = 5
    navigates = True

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Take nothing: the viewport moves the camera by itself."""
        yield from ()
        return None
