"""Changes of the region by a command: grow, shrink, invert, smooth the border.

Every entry of `REGION_EDITS` is a row for a menu; `changed(document)` is the document after it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from engine.region_shapes import grow, invert, rings_of, shrink, smooth_border
from plugins.api import I64, Document, EngineError, Mesh


@dataclass(frozen=True)
class RegionEdit:
    """One command on the region.

    Parameters
    ----------
    id : unique and stable.
    title : what the menu shows; also what the history says.
    shape : (mesh, roi) to the ids of the new region.
    icon : name of an icon.
    shortcut : key sequence.
    """

    id: str
    title: str
    shape: Callable[[Mesh, I64], I64]
    icon: str
    shortcut: str = ""

    def available(self, document: Document | None) -> bool:
        """Whether there is a region to change."""
        return document is not None and document.draft.roi is not None

    def changed(self, document: Document) -> Document:
        """Return the document with the region changed; the curves drawn on it go.

        Raises
        ------
        EngineError
            There is no region, or nothing of it would be left.
        """
        roi = document.draft.roi
        if roi is None:
            raise EngineError("There is no region. Press L and circle the part to change.")
        after = self.shape(document.mesh, roi)
        if len(after) == 0:
            raise EngineError("Nothing would be left of the region. Undo, or choose a larger one.")
        return document.with_draft(document.draft.with_roi(after))


def _larger(mesh: Mesh, roi: I64) -> I64:
    return grow(mesh, roi, rings_of(mesh))


def _smaller(mesh: Mesh, roi: I64) -> I64:
    return shrink(mesh, roi, rings_of(mesh))


def _smoother(mesh: Mesh, roi: I64) -> I64:
    return smooth_border(mesh, roi, 4 * rings_of(mesh, 0.01) ** 2)


REGION_EDITS = (
    RegionEdit("grow", "Grow the region", _larger, "mdi6.arrow-expand-all", "Ctrl+Shift+Up"),
    RegionEdit(
        "shrink", "Shrink the region", _smaller, "mdi6.arrow-collapse-all", "Ctrl+Shift+Down"
    ),
    RegionEdit("invert", "Invert the region", invert, "mdi6.select-inverse", "Ctrl+Shift+I"),
    RegionEdit(
        "smooth_border", "Smooth the region's border", _smoother, "mdi6.vector-polyline-minus"
    ),
)
