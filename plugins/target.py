"""Target: where a source curve shall go (Section 5.2.2, Fig. 10); redrawn, or dragged by a part."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from plugins.api import (
    F64,
    Context,
    Document,
    EngineError,
    Gesture,
    Pointer,
    Role,
    Source,
    Stroke,
    Tool,
    View,
    option,
    redraw_part,
    resample_target,
    tidy_stroke,
)
from plugins.grasp import GRAB, SHORTEST, extent, falloff, lengths
from plugins.source import stabiliser

NEAR = 28.0  # px: a press this near to a curve may begin a part of it anew
DECIDES = 12.0  # px a hand moves before it is told whether it drags a curve or draws it anew
ALONG = 0.9  # cosine to the curve: a hand that leaves along it draws a part of it anew
STUB = 0.4  # of the curve: so short a stroke beside it may have been meant for a part
INWARD = 0.3  # the same at an end of the curve, where a new one may begin at a wide angle


@dataclass(frozen=True)
class TargetOptions:
    """How a target is drawn and adjusted."""

    stabiliser: float = stabiliser()
    reach: float = option(
        0.3,
        "Reach",
        "How much of the curve follows when a part of it is dragged",
        low=0.05,
        high=1.0,
        step=0.05,
        unit="of the curve",
    )


class TargetTool(Tool):
    """Draws where the source shall go, and adjusts it; the surface follows."""

    id = "target"
    title = "Target"
    tip = "Draw where the source curve should go"
    icon = "mdi6.vector-polyline-edit"
    shortcut = "T"
    label = "Target curve"
    order = 40
    repeats = False
    Options = TargetOptions

    def available(self, document: Document) -> bool:
        """A target needs a source."""
        return document.draft.source is not None or bool(document.draft.acting)

    def claims(self, document: Document) -> bool:
        """After the source comes the target."""
        return self.available(document)

    def hint(self, document: Document) -> str:
        """Say what to draw now."""
        draft = document.draft
        if draft.source is not None:
            return "Turn the view if you like, then draw where the curve should go"
        if draft.acting:
            return (
                "Drag the curve, draw it or a part of it again, {tool.source} for another, "
                "{edit.apply} to apply"
            )
        return "Draw a source curve first: press {tool.source} and draw on the region"

    def draws(self, document: Document) -> Role | None:
        """The target of a waiting source; one that is there is taken hold of."""
        return "target" if document.draft.source is not None else None

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Draw the target of the waiting source, take hold of one, or draw the last one again."""
        draft = context.document.draft
        strokes = draft.strokes
        if draft.source is not None:
            return (yield from _draw(context, [pointer], draft.source, len(strokes)))
        if not draft.acting:
            raise EngineError("There is no source curve. Press {tool.source} and draw one.")
        held = _held(context, pointer)
        if held is not None:
            return (yield from _hold(context, pointer, *held))
        last = draft.acting[-1]
        which = next(i for i, stroke in enumerate(strokes) if stroke is last)
        return (yield from _draw(context, [pointer], _source(last), which))


def _hold(
    context: Context, pointer: Pointer, which: int, anchor: int, curve: F64, away: float
) -> Gesture:
    """Drag a part of a target, its neighbours along; or, leaving along it, draw it anew.

    Parameters
    ----------
    which, anchor : the stroke that is held, and where on its `curve` (c, 2) px.
    away : px from there to the press; where it is not on the curve, nothing is dragged.
    """
    stroke = context.document.draft.strokes[which]
    points = context.shown.vertices[stroke.anchors]
    share = falloff(curve, anchor, context.options.reach, stroke.closed)
    document: Document | None = None
    hand, decided = [pointer], False
    while pointer.kind != "release":
        pointer = yield
        hand.append(pointer)
        motion = np.array(pointer.xy) - hand[0].xy
        if not decided and np.linalg.norm(motion) >= DECIDES:
            decided = True
            meant = _meant(curve, anchor, motion, stroke.closed)
            if meant == "whole" or (meant == "drag" and away > GRAB):
                return (yield from _draw(context, hand, _source(stroke), which, points))
            if meant != "drag":
                held = (which, anchor, curve, points, meant == "forward")
                return (yield from _draw_part(context, hand, *held))
        if away > GRAB:
            continue
        context.say("Let go where the curve should be")
        target = curve + share[:, None] * motion
        document = _with_stroke(context, which, _stroke(_source(stroke), context.view, target))
        context.preview(document)
    return document


def _draw(
    context: Context, hand: list[Pointer], source: Source, which: int, points: F64 | None = None
) -> Gesture:
    """Draw a whole target; while the hand moves, the rest of the curve goes along.

    Parameters
    ----------
    hand : what it did so far; the rest is appended.
    source, which : what the target is for, and the place of its stroke.
    points : (c, 3) the anchors where they were when it began; None for where they are now.
    """
    view = context.view
    if points is None:
        # As it is now: while the hand moves, the form that is shown is already on its way.
        points = context.shown.vertices[source.anchors]
    start = view.project(points)
    context.say("Draw the whole curve where it should go")
    while hand[-1].kind != "release":
        hand.append((yield))
        drawn = _path(hand)
        context.draw(drawn, "target")
        if extent(drawn) >= SHORTEST:
            # Not yet the outline: that takes several times as long, and the end is to come.
            so_far = replace(_stroke(source, view, _carried(start, drawn)), outline=False)
            context.preview(_with_stroke(context, which, so_far))
    if extent(_path(hand)) < SHORTEST:
        return None
    tidy = tidy_stroke(_path(hand), 2.0, context.options.stabiliser)
    target = resample_target(points, tidy, view, closed=source.closed)
    strokes = context.document.draft.strokes
    if which < len(strokes) and lengths(target)[-1] < STUB * lengths(start)[-1]:
        context.notice(
            "That short stroke is the whole curve now; {edit.undo} brings the long one back. To "
            "draw a part again, begin on the curve"
        )
    return _with_stroke(context, which, _stroke(source, view, target))


def _draw_part(
    context: Context,
    hand: list[Pointer],
    which: int,
    anchor: int,
    curve: F64,
    points: F64,
    forward: bool,
) -> Gesture:
    """Draw a part of a target anew, from an anchor on; it ends where the hand is let go."""
    stroke = context.document.draft.strokes[which]
    view, options = context.view, context.options
    context.say("Draw this part again, and end on the curve")
    while True:
        path = tidy_stroke(_path(hand), 2.0, options.stabiliser)
        target = redraw_part(
            points, curve, path, view, anchor, forward, stroke.closed, options.reach
        )
        anew = _stroke(_source(stroke), view, target)
        if hand[-1].kind == "release":
            return _with_stroke(context, which, anew)
        context.draw(_path(hand), "target")
        context.preview(_with_stroke(context, which, replace(anew, outline=False)))
        hand.append((yield))


def _path(hand: list[Pointer]) -> F64:
    return np.array([pointer.xy for pointer in hand])


def _meant(
    curve: F64, anchor: int, motion: F64, closed: bool
) -> Literal["drag", "forward", "backward", "whole"]:
    """Tell what a hand means that took hold of a curve (c, 2) px and moved (2,) px.

    Whoever pulls a curve moves across it; whoever draws a part of it again begins along it. A whole
    one is begun at an end, where it goes on inwards.
    """
    if closed:
        middle = len(curve) // 2
        curve, anchor = np.roll(curve, middle - anchor, axis=0), middle
    s = lengths(curve)
    at = s[anchor] + GRAB * np.array([-1.0, 1.0])
    before, after = np.column_stack([np.interp(at, s, column) for column in curve.T])
    tangent = after - before
    sizes = np.linalg.norm(tangent) * np.linalg.norm(motion)
    cosine = float(tangent @ motion / max(sizes, 1e-300))
    if not closed and (s[anchor] <= GRAB or s[-1] - s[anchor] <= GRAB):
        inward = cosine if s[anchor] <= GRAB else -cosine
        return "whole" if inward > INWARD else "drag"
    if abs(cosine) < ALONG:
        return "drag"
    return "forward" if cosine > 0 else "backward"


def _source(stroke: Stroke) -> Source:
    return Source(stroke.anchors, stroke.view, stroke.closed, stroke.weights, stroke.outline)


def _stroke(source: Source, view: View, target: F64) -> Stroke:
    # From elsewhere the anchors are not on the outline any more: they meet the target themselves.
    outline = source.outline and source.view == view
    return Stroke(source.anchors, view, target, source.closed, source.weights, outline=outline)


def _with_stroke(context: Context, which: int, stroke: Stroke) -> Document:
    draft = context.document.draft
    strokes = (*draft.strokes[:which], stroke, *draft.strokes[which + 1 :])
    return context.document.with_draft(replace(draft, source=None, strokes=strokes))


def _carried(start: F64, drawn: F64) -> F64:
    """Return a target for a stroke that is still being drawn, (c, 2) px.

    The part of the source as long as the path so far lies on the path; the rest is carried along
    by the pen's tip. So nothing shrinks while the hand is on its way.
    """
    forward = np.linalg.norm(start[0] - drawn[0]) <= np.linalg.norm(start[-1] - drawn[0])
    source = start if forward else start[::-1]
    s = lengths(source)
    t = lengths(drawn)
    reached = s <= t[-1]
    # Between two anchors, or the rest would jump by an edge whenever the pen passes one.
    tip = [np.interp(t[-1], s, source[:, axis]) for axis in (0, 1)]
    target = source + (drawn[-1] - tip)
    for axis in (0, 1):
        target[reached, axis] = np.interp(s[reached], t, drawn[:, axis])
    return target if forward else np.ascontiguousarray(target[::-1])


def _held(context: Context, pointer: Pointer) -> tuple[int, int, F64, float] | None:
    """Return (stroke, anchor, its curve (c, 2) px now, px away) about the pointer, or None.

    In the view that the stroke was drawn in, the curve is the target itself; in any other view
    it is where the anchors are now, and adjusting it makes a stroke of that view.
    """
    best: tuple[float, int, int, F64] | None = None
    for which, stroke in enumerate(context.document.draft.strokes):
        if stroke.hidden:
            continue
        if stroke.view == context.view:
            curve = stroke.target
        else:
            curve = context.view.project(context.shown.vertices[stroke.anchors])
        away = np.linalg.norm(curve - np.array(pointer.xy), axis=1)
        anchor = int(away.argmin())
        if away[anchor] <= NEAR and (best is None or away[anchor] < best[0]):
            best = (float(away[anchor]), which, anchor, curve)
    return None if best is None else (*best[1:], best[0])
