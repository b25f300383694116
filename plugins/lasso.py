"""Lasso: circle a part of the form to choose the region; Shift adds, Ctrl or the eraser takes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from plugins.api import I64, Context, Document, EngineError, Gesture, Pointer, Tool

SHORTEST = 12.0  # px: a shorter path is a slip of the hand, not a lasso


@dataclass(frozen=True)
class LassoOptions:
    """What the lasso takes."""

    through: bool = field(
        default=False,
        metadata={"label": "Through", "tip": "Take hidden vertices behind the surface as well"},
    )


class Lasso(Tool):
    """Chooses the region by a closed curve around it."""

    id = "lasso"
    title = "Lasso"
    tip = "Circle the part you want to reshape"
    icon = "mdi6.lasso"
    shortcut = "L"
    label = "Region"
    order = 10
    repeats = False
    Options = LassoOptions

    def claims(self, document: Document) -> bool:
        """The flow begins with a region."""
        return document.draft.roi is None

    def hint(self, document: Document) -> str:
        """Say what the lasso does now."""
        if document.draft.roi is None:
            return self.tip
        return "Circle a new region, or hold Shift to add and Ctrl to take away"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Follow the lasso and combine what it caught with the region."""
        first = pointer
        path = [pointer.xy]
        while pointer.kind != "release":
            pointer = yield
            path.append(pointer.xy)
            context.draw(np.array(path), "region", closed=True)
        polygon = np.array(path)
        if np.ptp(polygon, axis=0).max() < SHORTEST:
            return None
        caught = context.vertices_inside(polygon, context.options.through)
        document = context.document
        roi = combined(document.draft.roi, caught, first)
        return document.with_draft(document.draft.with_roi(roi))


def combined(roi: I64 | None, caught: I64, first: Pointer) -> I64 | None:
    """Return the region after a gesture: replaced, or with Shift grown, with Ctrl or eraser cut.

    Raises
    ------
    EngineError
        Nothing was caught.
    """
    if len(caught) == 0:
        raise EngineError(
            "Nothing was caught. Circle a visible part of the form, or switch on “Through”."
        )
    if roi is None or not (first.shift or first.ctrl or first.eraser):
        return np.unique(caught)
    if first.shift:
        return np.union1d(roi, caught)
    left = np.setdiff1d(roi, caught)
    return left if len(left) else None
