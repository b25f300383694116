"""Pins and the feature under a click, fed with pointer events; no window."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, EngineError, decompose
from plugins.feature import Feature
from plugins.lasso import Lasso
from plugins.pin import Pin
from tests.plugins.flat import (
    FlatContext,
    around,
    chosen,
    do,
    line,
    plate,
    px,
)


def test_a_click_on_a_feature_sets_the_level_just_below_it() -> None:
    flat = plate(41)
    x, y, _ = flat.vertices.T
    broad = 4 * np.exp(-(((x + 20) / 12) ** 2 + (y / 12) ** 2))
    fine = 1.5 * np.exp(-(((x - 22.5) / 4) ** 2 + (y / 4) ** 2))
    mesh = flat.with_vertices(flat.vertices + np.column_stack([0 * x, 0 * x, broad + fine]))
    context = FlatContext(Document.open(mesh))
    chosen(context)
    context.document = do(Lasso(), context, around(0, 0, 44))
    context.decomposition = decompose(mesh, context.document.draft.roi)
    levels, counts = [], []
    for place in (-20.0, 22.5):
        context.options = None
        document = do(Feature(), context, [px(place, 0), px(place, 0)])
        levels.append(document.draft.level)
        counts.append(context.decomposition.mode_count(levels[-1]))
        gone = context.decomposition.surface(counts[-1])
        row = np.flatnonzero((context.decomposition.original[:, :2] == (place, 0)).all(axis=1))
        assert (
            abs(context.decomposition.original[row, 2] - gone[row, 2])
            > 0.4 * (broad + fine)[(x == place) & (y == 0)]
        )
    assert counts[0] < counts[1], "the fine bump appears later than the broad one"
    context.options = None
    with pytest.raises(EngineError, match="not on the region"):
        do(Feature(), context, [px(49, 49), px(49, 49)])


def test_a_pin_is_set_and_taken_out(context: FlatContext) -> None:
    chosen(context)
    pin = Pin()
    context.document = do(pin, context, [px(5, 5), px(5, 5)])
    (vertex,) = context.document.draft.options.pins
    assert context.document.mesh.vertices[vertex] == pytest.approx([5, 5, 0])
    assert do(pin, context, [px(6, 5), px(6, 5)]).draft.options.pins == ()
    with pytest.raises(EngineError, match="coloured part"):
        do(pin, context, [px(45, 45), px(45, 45)])


def test_a_pin_is_dragged_along_the_region(context: FlatContext) -> None:
    chosen(context)
    pin = Pin()
    for at in ((5, 5), (15, 5), (-10, 0)):
        context.document = do(pin, context, [px(*at), px(*at)])

    def places(document: Document) -> list[list[float]]:
        return document.mesh.vertices[list(document.draft.options.pins), :2].round(9).tolist()

    moved = do(pin, context, line((11, 5), (0, 15)))
    assert sorted(places(moved)) == [[-10, 0], [0, 15], [5, 5]], "the nearest one goes along"
    assert len(context.previews) > 5
    beyond = do(pin, context, line((15, 5), (48, 5), 60))
    assert max(places(beyond))[0] > 20, "it stays at the last place on the region"
    assert len(places(beyond)) == 3
    let_go = do(pin, context, [px(15, 5), px(16, 5), px(15, 5)])
    assert sorted(places(let_go)) == [[-10, 0], [5, 5]], "so short a drag is a click"


def test_a_pin_that_is_not_seen_is_left_alone(context: FlatContext) -> None:
    chosen(context)
    pin = Pin()
    context.document = do(pin, context, [px(5, 5), px(5, 5)])
    context.vertices_near = lambda x, y, radius, through=False: np.zeros(0, dtype=np.int64)
    (behind,) = context.document.draft.options.pins
    both = do(pin, context, [px(9.5, 5), px(9.5, 5)]).draft.options.pins
    assert len(both) == 2
    assert behind in both
