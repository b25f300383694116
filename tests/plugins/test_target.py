"""Target: drawn, drawn again and dragged with pointer events; no window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine import Document, Draft, EngineError
from plugins.lasso import Lasso
from plugins.source import SourceTool
from plugins.target import TargetTool
from tests.plugins.flat import (
    FlatContext,
    chosen,
    do,
    from_above,
    line,
    sketched,
)


def test_the_flow_hands_over_from_region_to_source_to_target(context: FlatContext) -> None:
    lasso, source, target = Lasso(), SourceTool(), TargetTool()

    def claimed(document: Document) -> list[str]:
        return [tool.id for tool in (lasso, source, target) if tool.claims(document)]

    assert claimed(context.document) == ["lasso"]
    chosen(context)
    assert claimed(context.document) == ["source"]
    context.document = do(source, context, line((-15, 2), (15, 2)))
    assert claimed(context.document) == ["target"]
    context.options = None
    context.document = do(target, context, line((-15, 12), (15, 12)))
    assert claimed(context.document) == ["target"]
    assert target.enter(context).strokes == context.document.draft.strokes


def test_a_target_drawn_backwards_is_the_same_target(context: FlatContext) -> None:
    chosen(context)
    context.document = do(SourceTool(), context, line((-15, 0), (15, 0)))
    context.options = None
    there = do(TargetTool(), context, line((-15, 10), (15, 10))).draft.strokes[0].target
    back = do(TargetTool(), context, line((15, 10), (-15, 10))).draft.strokes[0].target
    assert there == pytest.approx(back, abs=1e-9)
    assert there[:, 1] == pytest.approx(180.0, abs=6.0)


@pytest.mark.parametrize(("begin", "end"), [(-15, 15), (15, -15)])
def test_while_a_target_is_drawn_the_rest_goes_along_and_nothing_shrinks(
    context: FlatContext, begin: float, end: float
) -> None:
    chosen(context)
    context.document = do(SourceTool(), context, line((-15, 0), (15, 0)))
    context.options, context.previews = None, []
    do(TargetTool(), context, line((begin, 10), (end, 10)))
    assert len(context.previews) > 10
    for shown in context.previews:
        (stroke,) = shown.draft.strokes
        source = context.view.project(context.document.mesh.vertices[stroke.anchors])
        away = stroke.target - (source - (0, 20))
        assert np.abs(away).max() < 1e-6, "10 mm are 20 px"


def test_the_target_is_dragged_near_it_and_redrawn_elsewhere(context: FlatContext) -> None:
    sketched(context)
    (before,) = context.document.draft.strokes
    middle = before.target[len(before.target) // 2]
    dragged = do(TargetTool(), context, [middle, middle - (0, 5), middle - (0, 20)])
    (after,) = dragged.draft.strokes
    moved = after.target - before.target
    assert moved[len(moved) // 2] == pytest.approx([0, -20])
    assert moved[[0, -1]] == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    assert (np.diff(np.abs(moved[: len(moved) // 2, 1])) >= -1e-9).all(), "it falls off smoothly"
    context.document = dragged
    (again,) = do(TargetTool(), context, line((-15, -20), (15, -20))).draft.strokes
    assert again.target[:, 1].min() > 230
    assert (again.anchors == before.anchors).all()


def test_a_target_is_drawn_again_in_part_by_a_hand_that_leaves_along_it(
    context: FlatContext,
) -> None:
    chosen(context)
    for tool, y in ((SourceTool(), 0), (TargetTool(), 10)):
        context.document = do(tool, context, line((-28, y), (28, y), 40))
        context.options = None
    (before,) = context.document.draft.strokes
    x = np.sort(before.target[:, 0])
    start, end = x[len(x) // 4], x[3 * len(x) // 4]
    t = np.linspace(0, 1, 40)
    for forward in (True, False):
        along = np.column_stack([start + t * (end - start), 180.0 - 12.0 * np.sin(np.pi * t) ** 2])
        (after,) = do(TargetTool(), context, along if forward else along[::-1]).draft.strokes
        moved = np.linalg.norm(after.target - before.target, axis=1)
        outside = (before.target[:, 0] < start - 6) | (before.target[:, 0] > end + 6)
        assert moved.max() > 9
        assert moved[outside].max() < 1.0, "what was not drawn again stays"
        assert (after.anchors == before.anchors).all()
    assert "this part" in context.sayings[-1]
    # Set down beside the curve, the hand draws a part of it all the same, but drags nothing.
    (after,) = do(TargetTool(), context, along + np.array([0.0, 16.0])).draft.strokes
    moved = np.linalg.norm(after.target - before.target, axis=1)
    assert moved[outside].max() < 1.0 < 5.0 < moved.max()
    across = before.target[len(x) // 2] + np.array([[0.0, 20.0], [0.0, 26.0], [0.0, 40.0]])
    (after,) = do(TargetTool(), context, across).draft.strokes
    assert np.ptp(after.target[:, 1]) == pytest.approx(20.0, abs=2.0), "a new curve"


def test_a_whole_target_is_drawn_again_from_its_end(context: FlatContext) -> None:
    sketched(context)
    (before,) = context.document.draft.strokes
    ends = before.target[[0, -1]][np.argsort(before.target[[0, -1], 0])]
    t = np.linspace(0, 1, 40)[:, None]
    curve = ends[0] + t * (ends[1] - ends[0]) + np.sin(np.pi * t) * [0.0, 40.0]
    (after,) = do(TargetTool(), context, curve).draft.strokes
    assert after.target[:, 1].max() > before.target[:, 1].max() + 30
    assert np.ptp(after.target[:, 0]) == pytest.approx(np.ptp(before.target[:, 0]), abs=6.0)
    # Pulled across, the same end is dragged.
    (after,) = do(
        TargetTool(), context, [ends[0], ends[0] + (0, 8), ends[0] + (0, 30)]
    ).draft.strokes
    moved = np.linalg.norm(after.target - before.target, axis=1)
    assert moved.max() == pytest.approx(30.0)
    assert moved.min() == pytest.approx(0.0)


def test_a_target_is_adjusted_in_another_view(context: FlatContext) -> None:
    sketched(context)
    (before,) = context.document.draft.strokes
    context.view = from_above(1 / 50)
    now = context.view.project(context.shown.vertices[before.anchors])
    middle, down = now[len(now) // 2], np.array([0.0, 9.0])
    (after,) = do(TargetTool(), context, [middle, middle + down]).draft.strokes
    assert after.view == context.view
    assert after.target[len(now) // 2] == pytest.approx(middle + down)


def test_without_a_source_the_target_says_what_to_do(context: FlatContext) -> None:
    chosen(context)
    with pytest.raises(EngineError, match=r"Press \{tool\.source\}"):
        do(TargetTool(), context, line((-15, 10), (15, 10)))
    assert not TargetTool().available(context.document)
    bare = replace(context.document, draft=Draft())
    assert not SourceTool().available(bare)
