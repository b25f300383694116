"""Lasso: circle a part of the form to choose the region; Shift adds, Ctrl or the eraser takes."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from plugins.api import (
    F64,
    I64,
    Context,
    Document,
    EngineError,
    Gesture,
    Pointer,
    Role,
    Tool,
    option,
    tidy_stroke,
    without_specks,
)
from plugins.behind import ends_at_outline
from plugins.grasp import GRAB, SHORTEST, extent, falloff

DOUBLE_SECONDS, DOUBLE_PX = 0.4, 6.0
STEP = 4.0  # px between the points of a lasso that is adjusted
REACH = 0.12  # share of the lasso that follows on either side when it is dragged
SPECK = 0.004  # of the region: so little left out all around is not left out on purpose
ADJUST = "Drag the lasso into shape; {edit.apply} or a double click takes it, {edit.back} drops it"


@dataclass(frozen=True)
class LassoOptions:
    """What the lasso takes."""

    through: bool = option(
        False, "Through", "Take the back of the form as well: for a curve that moves the outline"
    )
    adjust: bool = option(
        False,
        "Adjust first",
        "The lasso stays and can be dragged into shape until Enter or a double click",
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
    waits = True
    Options = LassoOptions

    def claims(self, document: Document) -> bool:
        """The flow begins with a region."""
        return document.draft.roi is None

    def hint(self, document: Document) -> str:
        """Say what the lasso does now."""
        if document.draft.roi is None:
            return self.tip
        return "Circle a new region, or hold Shift to add and Ctrl to take away"

    def draws(self, document: Document) -> Role | None:
        """A curve around a part."""
        return "region"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Follow the lasso and combine what it caught with the region."""
        first = pointer
        polygon = yield from _drawn(context, pointer)
        if extent(polygon) < SHORTEST:
            return None
        if context.options.adjust:
            first, polygon = yield from _adjusted(context, first, polygon)
        caught = context.vertices_inside(polygon, context.options.through)
        document = context.document
        if len(caught) == 0 and context.options.through:
            raise EngineError("Nothing was caught. Circle a part of the form.")
        roi = combined(document.draft.roi, caught, first)
        if roi is not None and not (first.ctrl or first.eraser):
            # What is hidden in a groove, or the lasso just missed, would stay and pinch the form.
            roi = without_specks(document.mesh.topology, roi, SPECK)
            if not context.options.through and ends_at_outline(context, roi):
                context.notice(
                    "The region ends at the outline of the form; {region.through} takes the back "
                    "as well"
                )
        return document.with_draft(document.draft.with_roi(roi))


def _drawn(context: Context, pointer: Pointer) -> Generator[None, Pointer, F64]:
    """Follow a lasso to its end; return its path (p, 2) px."""
    path = [pointer.xy]
    while pointer.kind != "release":
        pointer = yield
        path.append(pointer.xy)
        context.draw(np.array(path), "region", closed=True)
    return np.array(path)


def _adjusted(
    context: Context, first: Pointer, polygon: F64
) -> Generator[None, Pointer, tuple[Pointer, F64]]:
    """Let the lasso be dragged, or drawn again, until Enter or a double click.

    Returns the press that the lasso in force was begun with, and the lasso (p, 2) px.
    """
    polygon = tidy_stroke(polygon, STEP)
    before: Pointer | None = None
    while True:
        context.draw(polygon, "region", closed=True)
        _show_caught(context, first, polygon)
        context.say(ADJUST)
        pointer = yield
        if pointer.kind == "enter":
            return first, polygon
        if pointer.kind != "press":
            continue
        if before is not None and _is_double(before, pointer):
            return first, polygon
        before = pointer
        away = np.linalg.norm(polygon - np.array(pointer.xy), axis=1)
        if away.min() <= GRAB:
            polygon = yield from _dragged(context, pointer, polygon, int(away.argmin()))
        else:
            path = yield from _drawn(context, pointer)
            if extent(path) >= SHORTEST:
                first, polygon = pointer, tidy_stroke(path, STEP)


def _dragged(
    context: Context, pointer: Pointer, polygon: F64, which: int
) -> Generator[None, Pointer, F64]:
    """Drag a part of the lasso; its neighbours follow smoothly."""
    grasp = np.array(pointer.xy)
    share = falloff(polygon, which, REACH, True)[:, None]
    moved = polygon
    while pointer.kind != "release":
        pointer = yield
        moved = polygon + share * (np.array(pointer.xy) - grasp)
        context.draw(moved, "region", closed=True)
    return moved


def _show_caught(context: Context, first: Pointer, polygon: F64) -> None:
    """Tint what the lasso would take as it is."""
    roi = context.document.draft.roi
    caught = context.vertices_inside(polygon, context.options.through)
    context.mark(combined(roi, caught, first) if len(caught) else roi)


def _is_double(before: Pointer, pointer: Pointer) -> bool:
    """Whether a press is the second of a double click; for pens nobody else says it."""
    apart = np.hypot(pointer.x - before.x, pointer.y - before.y)
    soon = pointer.time - before.time <= DOUBLE_SECONDS and apart <= DOUBLE_PX
    return bool(pointer.double or soon)


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
    cuts = not first.shift and (first.ctrl or first.eraser)
    before = roi if roi is not None and (first.shift or cuts) else caught[:0]
    inside = np.zeros(1 + max(int(ids.max(initial=0)) for ids in (before, caught)), dtype=bool)
    inside[before] = True
    inside[caught] = roi is None or not cuts
    left = np.flatnonzero(inside)
    return left if len(left) else None
