"""Source: a curve on the region, and what it asks of it; no window."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, EngineError, Mesh
from plugins.api import Pointer
from plugins.behind import ends_behind
from plugins.lasso import Lasso
from plugins.source import SourceOptions, SourceTool
from plugins.target import TargetOptions, TargetTool
from tests.plugins.flat import (
    FlatContext,
    around,
    chosen,
    do,
    line,
    px,
    sketched,
)


def test_a_source_is_a_chain_of_anchors_in_the_region(context: FlatContext) -> None:
    chosen(context)
    source = do(SourceTool(), context, line((-15, 2), (15, 2))).draft.source
    x = context.document.mesh.vertices[source.anchors]
    assert np.isin(source.anchors, context.document.draft.roi).all()
    assert (np.linalg.norm(np.diff(x, axis=0), axis=1) < 7.2).all(), "neighbours share an edge"
    assert source.view == context.view
    assert not context.notices
    do(SourceTool(), context, line((-15, 2), (49, 2)))
    with pytest.raises(EngineError, match="not on the region"):
        do(SourceTool(), context, line((-48, 45), (-40, 48)))
    with pytest.raises(EngineError, match="beside the form"):
        do(SourceTool(), context, line((70, -20), (75, 20)))
    assert do(SourceTool(), context, [px(0, 0), px(1, 0)]) is None


def test_a_source_that_leaves_the_form_lies_on_its_outline(context: FlatContext) -> None:
    context.document = do(Lasso(), context, around(40, 0, 31))
    context.options = None
    source = do(SourceTool(), context, line((48, -20), (53, 20))).draft.source
    x = context.document.mesh.vertices[source.anchors]
    assert (x[:, 0] == 50).all(), "the border of the plate"
    assert np.ptp(x[:, 1]) == pytest.approx(40, abs=6), "the whole length that was drawn"
    assert not context.notices


def test_a_source_that_leaves_the_region_says_what_is_left_of_it(context: FlatContext) -> None:
    chosen(context)
    do(SourceTool(), context, line((-20, 0), (44, 0)))
    (notice,) = context.notices
    assert "Only 7" in notice or "Only 8" in notice
    # Far from any outline nothing of the way beside the form can be followed.
    context.notices.clear()
    context.options = None
    context.document = do(Lasso(), context, around(40, 0, 31))
    context.options = None
    source = do(SourceTool(), context, line((20, 0), (90, 0))).draft.source
    assert "coloured part" in context.notices[0]
    assert np.isin(source.anchors, context.document.draft.roi).all()


def tube(across: float = 15.0, rows: int = 41, sides: int = 36) -> Mesh:
    """An open tube of 100 mm along y."""
    t, y = np.meshgrid(2 * np.pi * np.arange(sides) / sides, np.linspace(-50, 50, rows))
    x = np.column_stack([across * np.cos(t).ravel(), y.ravel(), across * np.sin(t).ravel()])
    i = np.arange(rows * sides).reshape(rows, sides)
    a, b = i[:-1].ravel(), np.roll(i[:-1], -1, axis=1).ravel()
    d, c = i[1:].ravel(), np.roll(i[1:], -1, axis=1).ravel()
    return Mesh(x, np.concatenate([np.column_stack([a, d, c]), np.column_stack([a, c, b])]))


@pytest.mark.parametrize(("behind", "told"), [(-20.0, False), (-1.0, True)])
def test_a_region_ends_behind_a_curve_only_where_it_ends_beside_it(
    behind: float, told: bool
) -> None:
    mesh = tube()
    x, y, z = mesh.vertices.T
    roi = np.flatnonzero((np.abs(y) < 33) & (z > behind))
    context = FlatContext(Document.open(mesh))
    edge = np.flatnonzero((np.abs(y) < 31) & (np.abs(x - 14.77) < 0.1) & (z > 0))
    assert len(edge) > 20
    assert ends_behind(context, edge, roi) is told


def test_a_loop_around_a_tube_does_not_ask_for_the_back() -> None:
    mesh = tube()
    y = mesh.vertices[:, 1]
    context = FlatContext(Document.open(mesh))
    loop = np.flatnonzero(np.abs(y) < 0.1)
    assert len(loop) == 36
    assert not ends_behind(context, loop, np.flatnonzero(np.abs(y) < 20))


def test_a_second_source_adds_a_stroke(context: FlatContext) -> None:
    sketched(context)
    context.options = None
    context.document = do(SourceTool(), context, line((-10, -10), (10, -10)))
    context.options = None
    two = do(TargetTool(), context, line((-10, -18), (10, -18)))
    assert len(two.draft.strokes) == 2
    assert two.draft.source is None


def test_a_curve_that_comes_back_is_closed(context: FlatContext) -> None:
    chosen(context)
    context.document = do(SourceTool(), context, around(0, 0, 20))
    source = context.document.draft.source
    assert source.closed
    context.options = None
    (stroke,) = do(TargetTool(), context, around(0, 0, 26)).draft.strokes
    assert stroke.closed
    away = np.linalg.norm(stroke.target - (200, 200), axis=1)
    assert away == pytest.approx(52, abs=9)


def test_pressure_becomes_the_anchors_weights(context: FlatContext) -> None:
    chosen(context)
    tool = SourceTool()
    context.options = SourceOptions(weights=True)
    points = line((-15, 0), (15, 0))
    gesture = tool.gesture(context, Pointer("press", *points[0], pen=True, pressure=0.1))
    next(gesture)
    for i, point in enumerate(points[1:]):
        firm = 0.1 if i < len(points) / 2 else 1.0
        gesture.send(Pointer("move", *point, pen=True, pressure=firm))
    with pytest.raises(StopIteration) as end:
        gesture.send(Pointer("release", *points[-1], pen=True, pressure=0.0))
    source = end.value.value.draft.source
    assert source.weights[[0, -1]] == pytest.approx([0.1, 1.0])
    context.options = SourceOptions(weights=True)
    assert do(tool, context, points).draft.source.weights is None, "a mouse has no pressure"


def test_the_stabiliser_takes_the_tremor_out(context: FlatContext) -> None:
    sketched(context)
    straight = line((-15, -20), (15, -20), n=61)
    wave = 3 * np.sin(np.arange(61) * 2 * np.pi / 30)
    rough = [(x, y + w) for (x, y), w in zip(straight, wave, strict=True)]

    def target(path: list[tuple[float, float]], strength: float) -> np.ndarray:
        context.options = TargetOptions(stabiliser=strength)
        return do(TargetTool(), context, path).draft.strokes[0].target

    tremor = [np.abs(target(rough, s) - target(straight, s))[2:-2].max() for s in (0.0, 20.0)]
    assert tremor[1] < 0.5 * tremor[0]
