"""Source: a curve on the form that will follow a target (Section 5.2.1, Fig. 9)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from plugins.api import (
    F64,
    I64,
    REGION_FIRST,
    Context,
    Document,
    EngineError,
    Gesture,
    Pointer,
    Role,
    Source,
    Tool,
    option,
    silhouette_chain,
    tidy_stroke,
    trace_anchors,
)
from plugins.behind import ends_behind
from plugins.grasp import SHORTEST, extent, lengths

CLOSES = 16.0  # px: a curve whose ends come this near, after a long way, is a closed one
COVERED = 0.9  # of a source: where less of it lies on the region, the person is told
MISSES = 0.08  # of a source: when more runs beside the form, its outline is meant
SAMPLE = 6.0  # px between the places where it is looked up what lies under a source
SAMPLES = 64  # such places at the most, in a long stroke further apart
SNAPS = 24.0  # px: an outline this near draws a stroke onto itself
HUGS = 8.0, 0.08  # px, and share of its length: a stroke all along so near to one is seen edge-on
ALONG, ALL_ALONG = 0.7, 0.95  # of a stroke: near an outline where it is meant, and else


def stabiliser() -> float:
    """Return the option of how much tremor is taken out of a stroke, px."""
    tip = "Takes the tremor of the hand out of a stroke"
    return option(4.0, "Stabiliser", tip, low=0.0, high=40.0, step=1.0, unit="px", decimals=0)


@dataclass(frozen=True)
class SourceOptions:
    """How a source curve is drawn."""

    stabiliser: float = stabiliser()
    weights: bool = option(
        False,
        "Pressure holds",
        "Where the pen pressed lightly the form follows the target less firmly",
    )
    outline: bool = option(
        False,
        "Snap to outline",
        "A stroke along the outline of the form lies on it exactly; Alt does it once",
    )


class SourceTool(Tool):
    """Draws the source curve on the region."""

    id = "source"
    title = "Source"
    tip = "Draw a curve on the region: the part of the form that will follow your target"
    icon = "mdi6.vector-curve"
    shortcut = "S"
    label = "Source curve"
    order = 30
    repeats = False
    Options = SourceOptions

    def available(self, document: Document) -> bool:
        """A source lies on a region."""
        return document.draft.roi is not None

    def claims(self, document: Document) -> bool:
        """After the region comes the source."""
        draft = document.draft
        return draft.roi is not None and draft.source is None and not draft.acting

    def hint(self, document: Document) -> str:
        """Say what to draw now."""
        draft = document.draft
        if draft.roi is None:
            return REGION_FIRST
        if draft.acting:
            return "Draw another curve on the region"
        if any(getattr(step, "roi", None) is draft.roi for step in document.recipe.steps):
            return "Draw another curve, change the level, or press {edit.back} to leave the region"
        return (
            "Slide the level, then draw a curve on the coloured part; Shift and the wheel grow or "
            "shrink it"
        )

    def draws(self, document: Document) -> Role | None:
        """A curve on the region."""
        return "source"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Follow the curve and find its anchors."""
        drawn, pressures = yield from _drawn(context, pointer)
        if extent(drawn) < SHORTEST:
            return None
        closed = _is_closed(drawn)
        path = tidy_stroke(drawn, 2.0, context.options.stabiliser)
        draft = context.document.draft
        if draft.roi is None:
            raise EngineError("There is no region. Press {tool.lasso} and circle a part first.")
        held, missed = _under(context, path, draft.roi)
        snaps = context.options.outline or pointer.alt or missed > MISSES
        anchors = _on_outline(context, path, draft.roi, closed, snaps)
        outlined = anchors is not None
        if anchors is None:
            if held < COVERED:
                context.notice(
                    f"Only {held:.0%} of the curve lies on the coloured part; the target takes "
                    "the place of that. {edit.back} drops it"
                )
            anchors = _on_surface(context, path, draft.roi, closed)
        weights = None
        if context.options.weights and pointer.pen:
            seen = context.view.project(context.shown.vertices[anchors])
            weights = _weights(seen, drawn, pressures)
        if ends_behind(context, anchors, draft.roi):
            context.notice(
                "The region ends just behind this curve; {region.through} takes the back as well"
            )
        source = Source(anchors, context.view, closed, weights, outlined)
        return context.document.with_draft(replace(draft, source=source))


def _drawn(context: Context, pointer: Pointer) -> Generator[None, Pointer, tuple[F64, F64]]:
    """Follow a stroke to its end; return its path (p, 2) px and the pressures (p,)."""
    path, pressures = [pointer.xy], [pointer.pressure]
    while pointer.kind != "release":
        pointer = yield
        path.append(pointer.xy)
        # A pen that is lifted reports no pressure, but the stroke does not end soft for that.
        pressures.append(pressures[-1] if pointer.kind == "release" else pointer.pressure)
        context.draw(np.array(path), "source")
    return np.array(path), np.array(pressures)


def _on_surface(context: Context, path: F64, roi: I64, closed: bool) -> I64:
    """Return the anchors below a path (p, 2) px."""
    faces = context.faces_under(path)
    if len(faces) == 0:
        raise EngineError(
            "The curve runs beside the form. Draw it on the coloured part, or slide the level up "
            "until the form fills its place."
        )
    if len(_inside(faces, context.shown.faces, roi)) == 0:
        if not np.isin(context.shown.faces, roi, kind="table").all(axis=1).any():
            raise EngineError(
                f"The region is only {len(roi)} vertices, too few for a curve. Grow it with "
                "{region.grow}, or circle a larger part."
            )
        raise EngineError("The curve is not on the region. Draw it on the coloured part.")
    found = trace_anchors(context.shown, faces, path, context.view, roi, closed)
    if found.parted:
        context.notice(
            "The curve runs over parts that are not connected; it was kept where most of it lies. "
            "{edit.back} drops it"
        )
    return found.anchors


def _under(context: Context, path: F64, roi: I64) -> tuple[float, float]:
    """Return which shares of a path (p, 2) px lie on the region, and beside the form."""
    along = lengths(path)
    pieces = min(max(2, round(along[-1] / SAMPLE)), SAMPLES)
    at = np.linspace(0, along[-1], pieces * max(1, round(2 * along[-1] / pieces)) + 1)[:-1]
    faces = context.faces_at(np.stack([np.interp(at, along, path[:, k]) for k in range(2)], axis=1))
    inside = np.zeros(context.shown.n, dtype=bool)
    inside[roi] = True
    held = (faces >= 0) & inside[context.shown.faces[faces]].all(axis=1)
    by_piece = (pieces, -1)
    missed = (faces < 0).reshape(by_piece).all(axis=1)
    return float(held.reshape(by_piece).any(axis=1).mean()), float(missed.mean())


def _on_outline(context: Context, path: F64, roi: I64, closed: bool, meant: bool) -> I64 | None:
    """Return the anchors on the form's outline beside a path (p, 2) px, or None without one.

    A path that keeps close to the outline without being meant for it is taken for one too: seen
    that edge-on, a tremor of the hand would be a wide zigzag in depth.
    """
    close, part = HUGS
    reach = SNAPS if meant else min(close, part * float(lengths(path)[-1]))
    left, top = path.min(axis=0) - 2 * SNAPS
    right, bottom = path.max(axis=0) + 2 * SNAPS
    around = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
    visible = context.vertices_inside(around)
    share = ALONG if meant else ALL_ALONG
    return silhouette_chain(context.shown, path, context.view, roi, closed, reach, visible, share)


def _is_closed(path: F64) -> bool:
    """Whether a path (p, 2) comes back to its start."""
    gap = float(np.linalg.norm(path[-1] - path[0]))
    return gap <= CLOSES and bool(lengths(path)[-1] > 8 * CLOSES)


def _weights(seen: F64, path: F64, pressures: F64) -> F64:
    """Return the pressure at each anchor (c,), in 0.05..1, from the nearest point of the path."""
    away = np.linalg.norm(seen[:, None, :] - path[None, :, :], axis=2)
    return np.asarray(np.clip(pressures[away.argmin(axis=1)], 0.05, 1.0))


def _inside(faces: I64, all_faces: I64, roi: I64) -> I64:
    """Keep the faces whose three corners are in the region, in their order."""
    inside = np.isin(all_faces[faces], roi, kind="table").all(axis=1)
    return np.asarray(faces[inside])
