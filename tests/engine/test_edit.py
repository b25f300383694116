"""SketchEdit: targets met, the rest untouched, details carried, always the same (Section 5.2)."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from engine import (
    Cancelled,
    EditOptions,
    Memo,
    Mesh,
    RecipeError,
    Run,
    SketchEdit,
    SketchError,
    Source,
    Stroke,
    View,
    resample_target,
)
from engine.arrays import F64, I64
from engine.measure import rim_dihedral, target_error

from .shapes import camera, inner, parallel, plate, sphere

SIDE = camera((0.5, -3.0, 0.6), (0.5, 0.5, 0.0))
PLATE = plate(41, wave=0.015)
ROI = inner(PLATE, 0.12, 0.88)


def row_of(mesh: Mesh, y: float, low: float, high: float) -> I64:
    """Vertices of the plate's grid row nearest to y, between two x, in order of x."""
    n = round(np.sqrt(mesh.n))
    ids = np.arange(n) * n + round(y * (n - 1))
    x = mesh.vertices[ids, 0]
    return np.asarray(ids[(x > low) & (x < high)])


def lifted(
    mesh: Mesh, view: View, anchors: I64, by: float, level_mesh: Mesh | None = None
) -> Stroke:
    """Stroke whose target is an arch, `by` px above where the anchors are seen."""
    seen = view.project((level_mesh or mesh).vertices[anchors])
    arch = np.sin(np.linspace(0.15, np.pi - 0.15, len(anchors)))
    return Stroke(anchors, view, seen - np.column_stack([0 * arch, by * arch]))


ANCHORS = row_of(PLATE, 0.5, 0.25, 0.75)
EDIT = SketchEdit(ROI, 0.0, (lifted(PLATE, SIDE, ANCHORS, 60),))


class TestSolve:
    @pytest.mark.parametrize("level", [0.0, 0.4, 1.0])
    def test_targets_are_met_and_the_rest_stays_to_the_bit(self, level: float) -> None:
        run = Run()
        edit = replace(EDIT, level=level)
        prepared = edit.prepare(PLATE, run)
        result = prepared.solve(edit.strokes)
        assert result.target_error_px < 0.5
        assert target_error(result.level_vertices, edit.strokes) < 0.5
        outside = np.setdiff1d(np.arange(PLATE.n), prepared.decomposition.roi)
        for x in (result.vertices, result.level_vertices):
            assert (x[outside] == PLATE.vertices[outside]).all()
        after = edit.apply(PLATE, run)
        assert after.faces is PLATE.faces
        assert (after.vertices == result.vertices).all()
        assert np.abs(after.vertices - PLATE.vertices).max() > 0.03

    @pytest.mark.parametrize("level", [0.0, 0.4])
    def test_a_still_stroke_moves_nothing(self, level: float) -> None:
        x = PLATE.vertices.copy()
        parts = replace(EDIT, level=level).prepare(PLATE).decomposition
        x[parts.roi] = parts.surface(parts.mode_count(level))
        still = Source(ANCHORS, SIDE).still(PLATE.with_vertices(x))
        after = SketchEdit(ROI, level, (still,)).apply(PLATE)
        assert (after.vertices == PLATE.vertices).all()

    def test_no_stroke_gives_the_original(self) -> None:
        assert (SketchEdit(ROI, 0.3, ()).apply(PLATE).vertices == PLATE.vertices).all()

    def test_it_repeats_to_the_bit(self) -> None:
        once, again = EDIT.apply(PLATE, Run()), EDIT.apply(PLATE, Run())
        assert (once.vertices == again.vertices).all()
        run = Run()
        moved = replace(EDIT, strokes=(lifted(PLATE, SIDE, ANCHORS, 20),))
        moved.apply(PLATE, run)
        assert (EDIT.apply(PLATE, run).vertices == once.vertices).all()

    def test_cancelling_leaves_nothing_half_done(self) -> None:
        told: list[str] = []
        memo = Memo()

        def stop_at_the_anchors(_: float, words: str) -> None:
            told.append(words)
            if words == "Preparing the surface":
                run.cancel()

        run = Run(stop_at_the_anchors, memo)
        with pytest.raises(Cancelled):
            EDIT.prepare(PLATE, run)
        assert told[-1] == "Preparing the surface"
        again = EDIT.apply(PLATE, Run(memo=memo))
        assert (again.vertices == EDIT.apply(PLATE).vertices).all()

    @pytest.mark.parametrize("count", [1, 2, 3, 7])
    def test_regions_of_a_few_vertices(self, count: int) -> None:
        roi = np.sort(ANCHORS[:count])
        stroke = lifted(PLATE, SIDE, ANCHORS[:count], 10)
        for level in (0.0, 1.0):
            result = SketchEdit(roi, level, (stroke,)).prepare(PLATE).solve((stroke,))
            assert result.target_error_px < 0.5
            assert np.isfinite(result.vertices).all()

    def test_several_islands(self) -> None:
        x = PLATE.vertices
        roi = np.flatnonzero(
            ((x[:, 0] < 0.45) | (x[:, 0] > 0.55)) & ~PLATE.topology.border_vertices
        )
        rows = (row_of(PLATE, 0.5, 0.15, 0.4), row_of(PLATE, 0.5, 0.6, 0.85))
        both = tuple(lifted(PLATE, SIDE, row, 30) for row in rows)
        result = SketchEdit(roi, 0.0, both).prepare(PLATE).solve(both)
        assert result.target_error_px < 0.5
        between = (x[:, 0] >= 0.45) & (x[:, 0] <= 0.55)
        assert (result.vertices[between] == x[between]).all()

    def test_parallel_projection(self) -> None:
        view = parallel(1, scale=0.8)
        stroke = lifted(PLATE, view, ANCHORS, 80)
        assert SketchEdit(ROI, 0.0, (stroke,)).prepare(PLATE).solve((stroke,)).target_error_px < 0.5

    def test_several_strokes_from_several_views(self) -> None:
        other = camera((3.5, 0.5, 0.8), (0.5, 0.5, 0.0))
        strokes = (
            lifted(PLATE, SIDE, row_of(PLATE, 0.35, 0.25, 0.75), 40),
            lifted(PLATE, other, row_of(PLATE, 0.65, 0.3, 0.7), -30),
        )
        result = SketchEdit(ROI, 0.0, strokes).prepare(PLATE).solve(strokes)
        assert result.target_error_px < 0.5

    def test_one_anchor_in_two_strokes_that_agree(self) -> None:
        other = camera((3.5, 0.5, 0.8), (0.5, 0.5, 0.0))
        where = PLATE.vertices[ANCHORS] + [0, 0, 0.05]
        strokes = (
            Stroke(ANCHORS, SIDE, SIDE.project(where)),
            Stroke(ANCHORS, other, other.project(where)),
        )
        result = SketchEdit(ROI, 1.0, strokes).prepare(PLATE).solve(strokes)
        assert result.target_error_px < 0.5
        assert np.abs(result.level_vertices[ANCHORS] - where).max() < 1e-4

    def test_two_strokes_that_disagree_in_one_view_meet_in_the_middle(self) -> None:
        first = EDIT.strokes[0]
        second = replace(first, target=first.target - np.array([0, 30.0]))
        result = replace(EDIT, strokes=(first, second)).prepare(PLATE).solve((first, second))
        assert result.target_error_px == pytest.approx(15, rel=0.05)

    def test_pins_stay(self) -> None:
        pins = row_of(PLATE, 0.6, 0.3, 0.7)
        options = EditOptions(pins=tuple(pins.tolist()))
        prepared = replace(EDIT, options=options).prepare(PLATE)
        level = prepared.decomposition.surface(prepared.k)
        result = prepared.solve(EDIT.strokes)
        at = np.searchsorted(prepared.decomposition.roi, pins)
        assert np.abs(result.level_vertices[pins] - level[at]).max() < 1e-7
        assert result.target_error_px < 0.5

    @pytest.mark.parametrize("amount", [0.0, 0.5, 1.5])
    def test_amount_is_the_share_of_the_way(self, amount: float) -> None:
        prepared = replace(EDIT, options=EditOptions(amount=amount)).prepare(PLATE)
        result = prepared.solve(EDIT.strokes)
        assert result.target_error_px < 0.5
        if amount == 0:
            assert (result.vertices == PLATE.vertices).all()
            return
        level = PLATE.vertices.copy()
        level[prepared.decomposition.roi] = prepared.decomposition.base
        start = SIDE.project(level[ANCHORS])
        gone = SIDE.project(result.level_vertices[ANCHORS]) - start
        assert np.allclose(gone, amount * (EDIT.strokes[0].target - start), atol=0.5)

    def test_depth_hold_keeps_the_depth(self) -> None:
        def drift(hold: float) -> float:
            options = EditOptions(depth_hold=hold)
            slanted = camera((0.5, -2.0, 1.8), (0.5, 0.5, 0.0))
            stroke = lifted(PLATE, slanted, ANCHORS, 60)
            prepared = SketchEdit(ROI, 0.0, (stroke,), options).prepare(PLATE)
            level = PLATE.vertices.copy()
            level[prepared.decomposition.roi] = prepared.decomposition.base
            after = prepared.solve((stroke,)).level_vertices
            return float(
                np.abs(slanted.depth(after[ANCHORS]) - slanted.depth(level[ANCHORS])).max()
            )

        drifts = [drift(hold) for hold in (0.0, 0.02, 1.0, 1e4)]
        assert drifts[0] >= drifts[1] > drifts[2] > drifts[3]
        assert drifts[3] < 1e-2 * drifts[0]

    def test_weights_let_an_anchor_give_way(self) -> None:
        weights = np.ones(len(ANCHORS))
        middle = len(ANCHORS) // 2
        weights[middle] = 0.01
        spike = EDIT.strokes[0].target.copy()
        spike[middle] -= [0, 30]
        hard = replace(EDIT.strokes[0], target=spike)
        soft = replace(hard, weights=weights)
        firm = replace(EDIT, strokes=(hard,)).prepare(PLATE).solve((hard,))
        given_way = replace(EDIT, strokes=(soft,)).prepare(PLATE).solve((soft,))
        assert firm.target_error_px < 0.5 < 10 < given_way.target_error_px

    def test_polish_keeps_the_target(self) -> None:
        options = EditOptions(polish=5)
        result = replace(EDIT, options=options).prepare(PLATE).solve(EDIT.strokes)
        assert result.target_error_px < 0.5
        plain = EDIT.prepare(PLATE).solve(EDIT.strokes)
        assert not np.allclose(result.vertices, plain.vertices, atol=1e-5)

    def test_the_rim_gets_no_crease(self) -> None:
        # The angle between triangles falls with their size where a surface is smooth; at a
        # crease it stays.
        folds = []
        for n in (21, 81):
            smooth = plate(n, jitter=0.0)
            roi = inner(smooth, 0.149, 0.851)
            stroke = lifted(smooth, SIDE, row_of(smooth, 0.5, 0.249, 0.751), 60)
            folds.append(rim_dihedral(SketchEdit(roi, 0.0, (stroke,)).apply(smooth), roi))
        assert folds[1] < 0.5 * folds[0]
        roi = EDIT.prepare(PLATE).decomposition.roi
        bumpy = EDIT.apply(PLATE)
        assert np.degrees(rim_dihedral(bumpy, roi)) < np.degrees(rim_dihedral(PLATE, roi)) + 1.0

    @settings(max_examples=8, deadline=None)
    @given(power=st.floats(-6, 6), offset=st.sampled_from([0.0, 10.0, 1e6]))
    def test_size_and_place_do_not_matter(self, power: float, offset: float) -> None:
        small = plate(17, wave=0.02)
        roi, row = inner(small, 0.1, 0.9), row_of(small, 0.5, 0.25, 0.75)
        edit = SketchEdit(roi, 0.0, (lifted(small, SIDE, row, 40),))
        expected = edit.apply(small).vertices
        size = 10.0**power
        place = np.array([offset, -offset, offset / 2]) * size
        world = np.diag([1 / size, 1 / size, 1 / size, 1.0])
        world[:3, 3] = -place / size
        view = View(SIDE.matrix @ world, SIDE.size)
        there = Mesh(small.vertices * size + place, small.faces)
        stroke = replace(edit.strokes[0], view=view)
        found = SketchEdit(roi, 0.0, (stroke,)).apply(there).vertices
        digits = 1e-7 if offset == 0 else 1e-14 * offset * 1e7 + 1e-7
        assert np.abs((found - place) / size - expected).max() < digits

    def test_symmetric_input_gives_a_symmetric_result(self) -> None:
        mesh = plate(21, jitter=0.0)
        half = np.arange(21 * 21).reshape(21, 21)
        # Diagonals of the grid are mirrored too, so that the triangles are symmetric in y.
        mirror_id = half[:, ::-1].ravel()
        left = mesh.faces[mesh.vertices[mesh.faces, 1].mean(axis=1) < 0.5]
        both = Mesh(mesh.vertices, np.vstack([left, mirror_id[left][:, ::-1]]))
        row = half[5:16, 10].copy()
        view = camera((-3.0, 0.5, 0.5), (0.5, 0.5, 0.0))
        stroke = lifted(both, view, row, 50)
        after = SketchEdit(inner(both, 0.1, 0.9), 0.0, (stroke,)).apply(both).vertices
        mirrored = after[mirror_id] * [1, -1, 1] + [0, 1, 0]
        assert np.abs(mirrored - after).max() < 1e-8


def bent(points: F64, degrees: float) -> F64:
    """The plate's plane rolled up around y so that its ends turn by `degrees` from the middle."""
    radius = 0.5 / np.radians(degrees)
    t = (points[:, 0] - 0.5) / radius
    r = radius - points[:, 2]
    return np.column_stack([0.5 + r * np.sin(t), points[:, 1], radius - r * np.cos(t)])


class TestDetails:
    mesh = plate(61, wave=0.01, waves=10.0)

    def kept(self, degrees: float, rectify: bool) -> float:
        """Height of the waves over the bent base along its normals, as a share of what it was."""
        edit = SketchEdit(inner(self.mesh, 0.05, 0.95), 0.0, (), EditOptions(rectify=rectify))
        prepared = edit.prepare(self.mesh)
        parts, region = prepared.decomposition, prepared.decomposition.region
        goal = bent(parts.base, degrees)
        detailed = prepared.detailed((goal - parts.base) / region.scale)
        above = parts.base + np.array([0, 0, 1e-6])
        normal = (bent(above, degrees) - goal) / 1e-6
        before = (parts.original - parts.base)[:, 2]
        after = np.einsum("ma,ma->m", detailed - goal, normal)
        return float(before @ after / (before @ before))

    def test_waves_keep_their_height_when_the_base_is_bent(self) -> None:
        assert self.kept(60, rectify=True) >= 0.95
        assert self.kept(60, rectify=False) < 0.88

    def test_without_rectification_it_gets_worse_with_the_bend(self) -> None:
        heights = [self.kept(degrees, rectify=False) for degrees in (30, 60, 90)]
        assert heights[0] > heights[1] > heights[2]
        assert heights[2] < 0.75

    def test_a_rigid_motion_of_the_base_carries_the_details_rigidly(self) -> None:
        prepared = SketchEdit(inner(self.mesh, 0.1, 0.9), 0.0, ()).prepare(self.mesh)
        parts, region = prepared.decomposition, prepared.decomposition.region
        turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
        rest = np.vstack([parts.base, self.mesh.vertices[region.patch[parts.m :]]])
        goal = rest @ turn.T + [1, 2, 3]
        # All of the patch moves, so that the rings at the rim are carried rigidly too.
        surface = prepared._surface
        lse_rest = surface.lse.positions.copy()
        try:
            surface.lse.positions[parts.m :] = (goal[parts.m :] - region.centre) / region.scale
            found = prepared.detailed((goal[: parts.m] - parts.base) / region.scale)
        finally:
            surface.lse.positions[:] = lse_rest
        assert np.abs(found - (parts.original @ turn.T + [1, 2, 3])).max() < 1e-9

    def test_at_level_1_there_is_nothing_to_put_back(self) -> None:
        edit = replace(EDIT, level=1.0)
        result = edit.prepare(PLATE).solve(edit.strokes)
        assert np.abs(result.vertices - result.level_vertices).max() < 1e-12


class TestZigzag:
    def test_the_surface_along_the_source_is_smoother_than_by_the_papers_rule(self) -> None:
        ball = sphere(5)
        view = camera((0.0, -6.0, 0.0))
        x = ball.vertices
        roi = np.flatnonzero(x[:, 1] < 0.3)
        # A chain that zigzags between two rows of vertices.
        t = np.linspace(-0.6, 0.6, 40)
        points = np.column_stack([t, np.full(40, -1.0), 0.3 * t + 0.01 * (-1.0) ** np.arange(40)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        near = np.linalg.norm(x[None] - points[:, None], axis=2).argmin(axis=1)
        anchors = near[np.sort(np.unique(near, return_index=True)[1])]
        drawn = view.project(np.column_stack([t, np.full(40, -0.8), 0.3 * t]))
        drawn[:, 1] -= 60 * np.cos(t * 2)

        def roughness(carry: bool) -> float:
            target = resample_target(x[anchors], drawn, view, carry_zigzag=carry)
            after = SketchEdit(roi, 1.0, (Stroke(anchors, view, target),)).apply(ball)
            return rim_dihedral(after, anchors)

        assert roughness(True) < 0.6 * roughness(False)


strokes = st.integers(1, 5).flatmap(
    lambda c: st.builds(
        Stroke,
        anchors=st.lists(st.integers(0, 10**6), min_size=c, max_size=c, unique=True).map(
            lambda ids: np.array(ids, dtype=np.int64)
        ),
        view=st.builds(
            View,
            hnp.arrays(np.float64, (4, 4), elements=st.floats(-1e6, 1e6)),
            st.tuples(st.floats(1, 1e4), st.floats(1, 1e4)),
        ),
        target=hnp.arrays(np.float64, (c, 2), elements=st.floats(-1e6, 1e6)),
        closed=st.booleans(),
        weights=st.none() | hnp.arrays(np.float64, c, elements=st.floats(1e-6, 1)),
    )
)
options = st.builds(
    EditOptions,
    rim=st.sampled_from(["smooth", "paper"]),
    rectify=st.booleans(),
    depth_hold=st.floats(0, 1e6),
    amount=st.floats(0, 1.5),
    polish=st.integers(0, 1000),
    pins=st.lists(st.integers(0, 10**6), max_size=4).map(tuple),
    mirror=st.just(()) | st.tuples(st.floats(0.1, 1), *[st.floats(-1e3, 1e3)] * 3),
    free_borders=st.booleans(),
)
edits = st.builds(
    SketchEdit,
    roi=st.lists(st.integers(0, 10**6), min_size=1, max_size=20, unique=True).map(
        lambda ids: np.array(sorted(ids), dtype=np.int64)
    ),
    level=st.floats(0, 1),
    strokes=st.lists(strokes, max_size=3).map(tuple),
    options=options,
)


class TestJson:
    @settings(max_examples=60, deadline=None)
    @given(edit=edits)
    def test_there_and_back(self, edit: SketchEdit) -> None:
        text = json.dumps(edit.to_json(), allow_nan=False)
        back = SketchEdit.from_json(json.loads(text))
        assert (back.roi == edit.roi).all()
        assert back.level == edit.level
        assert back.options == edit.options
        assert len(back.strokes) == len(edit.strokes)
        for a, b in zip(back.strokes, edit.strokes, strict=True):
            assert (a.anchors == b.anchors).all()
            assert a.view == b.view
            assert (a.target == b.target).all()
            assert a.closed == b.closed
            assert (a.weights is None) == (b.weights is None)
            assert a.weights is None or (a.weights == b.weights).all()
        assert json.dumps(back.to_json()) == text

    def test_what_was_read_gives_the_same_bits(self) -> None:
        back = SketchEdit.from_json(json.loads(json.dumps(EDIT.to_json())))
        assert (back.apply(PLATE).vertices == EDIT.apply(PLATE).vertices).all()

    def test_lists_of_ids_are_read_too(self) -> None:
        data = EDIT.to_json() | {"roi": ROI.tolist()}
        assert (SketchEdit.from_json(data).roi == ROI).all()

    @pytest.mark.parametrize(
        ("where", "value"),
        [
            ("roi", []), ("roi", "1-"), ("roi", [-1]), ("roi", [0.5]), ("roi", None), ("roi", {}),
            ("roi", [[1]]), ("roi", ["1"]), ("roi", [2**70]), ("roi", "0-99999999999"),
            ("level", 2), ("level", -0.1), ("level", "0"), ("level", None), ("level", True),
            ("level", float("nan")), ("level", float("inf")), ("strokes", {}), ("strokes", [1]),
            ("strokes", None), ("options", []), ("options", {"depth_hold": -1}), ("color", 1),
            ("options", {"depth_hold": float("inf")}), ("options", {"amount": 9}),
            ("options", {"polish": 1.5}), ("options", {"polish": 10**9}), ("options", {"x": 1}),
            ("options", {"rim": "soft"}), ("options", {"rectify": 1}), ("options", {"pins": [-1]}),
            ("options", {"pins": "3"}), ("options", {"mirror": [1, 2]}),
            ("options", {"mirror": [0, 0, 0, 1]}), ("options", {"free_borders": "no"}),
            ("anchors", []), ("anchors", [1, 1]), ("anchors", [-1]), ("anchors", [1.5]),
            ("anchors", "1"), ("anchors", [[1]]), ("target", [[1e7, 0]]), ("target", [[1, 2, 3]]),
            ("target", [1, 2]), ("target", [[float("nan"), 0]]), ("target", [["a", "b"]]),
            ("target", [[1, 2], [3]]), ("weights", [0.0]), ("weights", [2.0]), ("weights", "x"),
            ("view", {}), ("view", []), ("view", {"matrix": [[1]], "size": [1, 1]}),
            ("view", {"matrix": np.eye(4).tolist(), "size": [0, 1]}), ("closed", 1), ("pen", 3),
            ("view", {"matrix": [[float("inf")] * 4] * 4, "size": [9, 9]}),
        ],
    )  # fmt: skip
    def test_absurd_data_is_refused(self, where: str, value: Any) -> None:
        stroke = Stroke(np.array([3]), SIDE, np.array([[1.0, 2.0]]))
        data: dict[str, Any] = SketchEdit(ROI, 0.5, (stroke,)).to_json()
        if where in ("roi", "level", "strokes", "options", "color"):
            data[where] = value
        else:
            data["strokes"][0][where] = value
        with pytest.raises(RecipeError):
            SketchEdit.from_json(data)

    @pytest.mark.parametrize("name", ["roi", "level", "strokes"])
    def test_what_is_missing_is_named(self, name: str) -> None:
        data = EDIT.to_json()
        del data[name]
        with pytest.raises(RecipeError, match=name):
            SketchEdit.from_json(data)


class TestRefused:
    def test_vertices_that_the_mesh_does_not_have(self) -> None:
        for edit in (
            replace(EDIT, roi=np.append(ROI, 10**6)),
            replace(EDIT, strokes=(replace(EDIT.strokes[0], anchors=ANCHORS + 10**6),)),
            replace(EDIT, options=EditOptions(pins=(10**6,))),
        ):
            with pytest.raises(RecipeError, match="another mesh"):
                edit.apply(PLATE)

    def test_absurd_numbers_set_from_a_script(self) -> None:
        for edit in (
            replace(EDIT, level=float("nan")),
            replace(EDIT, options=EditOptions(amount=float("inf"))),
            replace(EDIT, strokes=(replace(EDIT.strokes[0], target=np.full((3, 2), np.nan)),)),
        ):
            with pytest.raises(RecipeError):
                edit.apply(PLATE)

    def test_a_curve_behind_the_camera(self) -> None:
        behind = camera((0.5, -3.0, 0.6), (0.5, -6.0, 0.6))
        stroke = Stroke(ANCHORS, behind, np.full((len(ANCHORS), 2), 100.0))
        with pytest.raises(SketchError, match="behind the camera"):
            SketchEdit(ROI, 0.0, (stroke,)).apply(PLATE)

    def test_anchors_that_cannot_move(self) -> None:
        border = np.flatnonzero(PLATE.topology.border_vertices)[:5]
        stroke = Stroke(border, SIDE, SIDE.project(PLATE.vertices[border]) + 5)
        with pytest.raises(SketchError, match="can move"):
            SketchEdit(ROI, 0.0, (stroke,)).apply(PLATE)
