"""Lasso, source and target, fed with pointer events; no window."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from engine import Decomposition, Document, Draft, EngineError, Mesh, View, decompose
from plugins.api import Hit, Pointer, Tool
from plugins.behind import ends_behind
from plugins.brush import Brush, BrushOptions
from plugins.feature import Feature
from plugins.lasso import Lasso, LassoOptions
from plugins.pin import Pin
from plugins.source import SourceOptions, SourceTool
from plugins.target import TargetOptions, TargetTool

SIZE = (400.0, 400.0)


def plate(n: int = 21) -> Mesh:
    """A square of 100 mm in the x, y plane, looked at from above."""
    x, y = np.meshgrid(np.linspace(-50, 50, n), np.linspace(-50, 50, n))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]), faces)


def from_above(scale: float = 1 / 100) -> View:
    """An orthographic view along -z: 2 px a millimetre, the origin in the middle."""
    return View(np.diag([scale, scale, -scale, 1.0]), SIZE)


def px(x: float, y: float) -> tuple[float, float]:
    """Pixel of a point of the plate, mm."""
    return (200 + 2 * x, 200 - 2 * y)


@dataclass
class FlatContext:
    """What a tool sees of a plate that lies flat under the eye."""

    document: Document
    options: Any = None
    decomposition: Decomposition | None = None
    view: View = field(default_factory=from_above)
    drawn: list[tuple[np.ndarray, str]] = field(default_factory=list)
    marked: list[np.ndarray] = field(default_factory=list)
    previews: list[Document] = field(default_factory=list)
    sayings: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)

    @property
    def shown(self) -> Mesh:
        return self.document.mesh

    def pick(self, x: float, y: float) -> Hit | None:
        away = np.linalg.norm(self.view.project(self.shown.vertices) - (x, y), axis=1)
        vertex = int(away.argmin())
        if away[vertex] > 10.0:
            return None  # the plate ends here
        return Hit(0, vertex, self.shown.vertices[vertex])

    def towards(self, side: str) -> np.ndarray:
        sides = {"right": (1, 0, 0), "front": (0, -1, 0), "top": (0, 0, 1)}
        return np.array(sides[side], dtype=np.float64)

    def vertices_inside(self, polygon: np.ndarray, through: bool = False) -> np.ndarray:
        seen = self.view.project(self.shown.vertices)
        return np.flatnonzero(Outline(polygon).contains_points(seen))

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> np.ndarray:
        seen = self.view.project(self.shown.vertices)
        return np.flatnonzero(np.linalg.norm(seen - (x, y), axis=1) <= radius)

    def faces_under(self, path: np.ndarray) -> np.ndarray:
        seen = self.view.project(self.shown.vertices)
        corners = seen[self.shown.faces]
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        t = np.linspace(0, 1, int(length) + 2)
        s = np.concatenate([[0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()]) / length
        found = []
        for at in np.column_stack([np.interp(t, s, path[:, 0]), np.interp(t, s, path[:, 1])]):
            e = [corners[:, (k + 1) % 3] - corners[:, k] for k in range(3)]
            r = [at - corners[:, k] for k in range(3)]
            side = [a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] for a, b in zip(e, r, strict=True)]
            inside = np.all([q >= 0 for q in side], axis=0) | np.all([q <= 0 for q in side], axis=0)
            found += np.flatnonzero(inside)[:1].tolist()
        ids = np.array(found, dtype=np.int64)
        return ids[np.append(True, np.diff(ids) != 0)] if len(ids) else ids

    def draw(self, path: np.ndarray, role: str, closed: bool = False) -> None:
        self.drawn.append((path, role))

    def mark(self, ids: np.ndarray) -> None:
        self.marked.append(ids)

    def preview(self, change: Document) -> None:
        self.previews.append(change)

    def say(self, text: str) -> None:
        self.sayings.append(text)

    def notice(self, text: str) -> None:
        self.notices.append(text)


def do(tool: Tool, context: FlatContext, path: Iterable[tuple[float, float]], **keys: Any) -> Any:
    """Press, move and release along a path; return what the tool returned."""
    context.options = tool.Options() if context.options is None else context.options
    points = list(path)
    gesture = tool.gesture(context, Pointer("press", *points[0], **keys))
    try:
        next(gesture)
        for point in points[1:]:
            gesture.send(Pointer("move", *point, **keys))
        gesture.send(Pointer("release", *points[-1], **keys))
    except StopIteration as end:
        return end.value
    raise AssertionError("the gesture did not end with the release")


def around(x: float, y: float, r: float) -> list[tuple[float, float]]:
    return [px(x + r * np.cos(t), y + r * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 40)]


def line(a: tuple[float, float], b: tuple[float, float], n: int = 20) -> list[tuple[float, float]]:
    return [px(*(np.array(a) + t * (np.array(b) - a))) for t in np.linspace(0, 1, n)]


@pytest.fixture
def context() -> FlatContext:
    return FlatContext(Document.open(plate()))


def chosen(context: FlatContext) -> FlatContext:
    context.document = do(Lasso(), context, around(0, 0, 31))
    context.options = None
    return context


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


def sketched(context: FlatContext) -> FlatContext:
    chosen(context)
    context.document = do(SourceTool(), context, line((-15, 0), (15, 0)))
    context.options = None
    context.document = do(TargetTool(), context, line((-15, 10), (15, 10)))
    return context


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


def test_without_a_source_the_target_says_what_to_do(context: FlatContext) -> None:
    chosen(context)
    with pytest.raises(EngineError, match=r"Press \{tool\.source\}"):
        do(TargetTool(), context, line((-15, 10), (15, 10)))
    assert not TargetTool().available(context.document)
    bare = replace(context.document, draft=Draft())
    assert not SourceTool().available(bare)


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
