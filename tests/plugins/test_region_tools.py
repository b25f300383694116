"""Lasso and brush, fed with pointer events; no window."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, EngineError
from plugins.brush import Brush, BrushOptions
from plugins.lasso import Lasso, LassoOptions
from tests.plugins.flat import (
    FlatContext,
    around,
    do,
    line,
    plate,
    px,
)


def test_a_lasso_takes_what_it_circles(context: FlatContext) -> None:
    document = do(Lasso(), context, around(0, 0, 31))
    away = np.linalg.norm(context.document.mesh.vertices, axis=1)
    assert (np.sort(document.draft.roi) == np.flatnonzero(away < 31)).all()
    assert context.drawn[-1][1] == "region"
    assert document.mesh is context.document.mesh


def test_shift_adds_control_and_the_eraser_take_away(context: FlatContext) -> None:
    context.document = do(Lasso(), context, around(0, 0, 21))
    first = context.document.draft.roi
    grown = do(Lasso(), context, around(20, 0, 11), shift=True).draft.roi
    assert set(first) < set(grown)
    for key in ("ctrl", "eraser"):
        cut = do(Lasso(), context, around(0, 0, 11), **{key: True}).draft.roi
        assert set(cut) < set(first)
    assert do(Lasso(), context, around(0, 0, 45), ctrl=True).draft.roi is None


def test_a_spot_is_taken_away_on_purpose_and_left_out_by_chance() -> None:
    """What a lasso misses within the region comes along; what is taken out of it stays out."""
    context = FlatContext(Document.open(plate(31)))
    context.document = do(Lasso(), context, around(0, 0, 45))
    whole = context.document.draft.roi
    middle = int(np.linalg.norm(context.document.mesh.vertices, axis=1).argmin())
    for key in ("ctrl", "eraser"):
        cut = do(Lasso(), context, around(0, 0, 3.2), **{key: True}).draft.roi
        assert set(whole) - set(cut) == {middle}
    missed = context.vertices_inside
    context.vertices_inside = lambda polygon, through=False: np.setdiff1d(
        missed(polygon, through), [middle]
    )
    assert middle in do(Lasso(), context, around(0, 0, 45)).draft.roi


def test_a_click_is_no_lasso_and_an_empty_one_is_told(context: FlatContext) -> None:
    assert do(Lasso(), context, [px(0, 0), px(1, 1)]) is None
    with pytest.raises(EngineError, match="Nothing was caught"):
        do(Lasso(), context, around(80, 80, 10))
    context.options = LassoOptions(through=True)
    with pytest.raises(EngineError, match="Circle a part of the form"):
        do(Lasso(), context, around(80, 80, 10))


def test_the_brush_paints_and_its_eraser_takes_away(context: FlatContext) -> None:
    brush = Brush()
    assert brush.repeats
    context.options = BrushOptions(radius=20.0)
    assert brush.circle(context.options) == 20.0
    context.document = do(brush, context, line((-30, 0), (30, 0), n=4))
    x = context.document.mesh.vertices[context.document.draft.roi]
    assert np.abs(x[:, 1]).max() <= 10
    assert np.ptp(x[:, 0]) > 60
    assert len(np.unique(x[:, 0])) >= 15, "no gap on the way"
    grown = do(brush, context, line((0, -30), (0, 30)))
    assert set(context.document.draft.roi) < set(grown.draft.roi)
    assert (context.marked[-1] == grown.draft.roi).all(), "it is seen while it is painted"
    for key in ("ctrl", "eraser"):
        cut = do(brush, context, line((0, 0), (30, 0)), **{key: True}).draft.roi
        assert 0 < len(cut) < len(context.document.draft.roi)
    with pytest.raises(EngineError, match="touched nothing"):
        do(brush, context, [(3, 3), (5, 5)])


def test_a_light_pen_paints_narrower(context: FlatContext) -> None:
    context.options = BrushOptions(radius=30.0)
    firm = do(Brush(), context, line((-20, 0), (20, 0)), pen=True, pressure=1.0).draft.roi
    light = do(Brush(), context, line((-20, 0), (20, 0)), pen=True, pressure=0.2).draft.roi
    assert set(light) < set(firm)
