"""The handle, fed with pointer events; no window."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Document, EngineError
from plugins.handle import Handle, HandleOptions, HandleStep, similarity
from tests.plugins.flat import FlatContext, do, from_above, line, plate, px


@pytest.fixture
def context() -> FlatContext:
    document = Document.open(plate(41))
    away = np.linalg.norm(document.mesh.vertices, axis=1)
    roi = np.flatnonzero(away < 40)
    context = FlatContext(document.with_draft(document.draft.with_roi(roi)))
    context.options = HandleOptions(radius=20.0)
    return context


def test_dragging_moves_the_grasp_with_the_pointer(context: FlatContext) -> None:
    step = do(Handle(), context, line((0, 0), (12, 5)))
    assert isinstance(step, HandleStep)
    assert len(context.previews) >= 10, "the form follows live"
    mesh = context.document.mesh
    after = step.apply(mesh)
    middle = int(np.linalg.norm(mesh.vertices, axis=1).argmin())
    assert middle in step.patch
    assert after.vertices[middle] == pytest.approx([12, 5, 0], abs=1e-9)
    away = np.linalg.norm(mesh.vertices[step.patch], axis=1)
    assert away.max() <= 10, "20 px are 10 mm"
    again = HandleStep.from_json(step.to_json())
    assert (again.apply(mesh).vertices == after.vertices).all()


def test_in_perspective_too_the_grasp_stays_below_the_pointer() -> None:
    from engine.view import look_at

    view = look_at((0, 0, 0), 300, 30, 40, (400, 400))
    grasp = np.array([20.0, 10.0, 5.0])
    drag = np.array([70.0, -45.0])
    M = similarity(view, "move", drag, grasp, grasp)
    moved = grasp + M[:3, 3]
    assert view.project(moved)[0] - view.project(grasp)[0] == pytest.approx(drag, abs=1e-9)
    assert view.depth(moved) == pytest.approx(view.depth(grasp)), "parallel to the picture"


def test_shift_turns_and_control_scales_about_the_middle(context: FlatContext) -> None:
    turn = np.array(do(Handle(), context, line((0, 0), (20, 0)), shift=True).matrix).reshape(4, 4)
    R = turn[:3, :3]
    assert pytest.approx(np.eye(3), abs=1e-12) == R @ R.T
    # 40 px to the right roll the side that is seen to the right: about +y, by a twelfth of a turn.
    assert pytest.approx([np.sin(np.pi / 6), 0, np.cos(np.pi / 6)]) == R @ [0, 0, 1]
    grown = np.array(do(Handle(), context, line((0, 0), (70, 0)), ctrl=True).matrix).reshape(4, 4)
    assert grown[:3, :3] == pytest.approx(2 * np.eye(3))
    context.options = HandleOptions(radius=20.0, motion="twist")
    twist = np.array(do(Handle(), context, line((0, 0), (60, 0))).matrix).reshape(4, 4)
    assert twist[:3, :3] @ [1, 0, 0] == pytest.approx([0, -1, 0], abs=1e-12), "clockwise as seen"
    for M in (turn, grown, twist):
        assert M[:3, 3] == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_handle_grows_to_the_right_and_up_and_turns_with_the_hand(context: FlatContext) -> None:
    middle = np.array([3.0, 4.0, 0.0])

    def matrix(motion: str, drag: tuple[float, float], normal: np.ndarray | None = None):
        return similarity(context.view, motion, np.array(drag), middle, middle, normal)

    for drag, size in (((140, 0), 2.0), ((0, -140), 2.0), ((-70, 70), 0.5), ((70, 70), 1.0)):
        assert matrix("scale", drag)[:3, :3] == pytest.approx(size * np.eye(3))
    # Up by a twelfth of a turn: what faces the eye goes up, about +x backwards.
    up = matrix("turn", (0, -40))[:3, :3]
    assert up @ [0, 0, 1] == pytest.approx([0, np.sin(np.pi / 6), np.cos(np.pi / 6)])
    for motion in ("turn", "twist", "scale"):
        there = matrix(motion, (31, -12))
        assert there @ [*middle, 1] == pytest.approx([*middle, 1]), "the middle stays"
    for normal in np.eye(3):
        one, other = (matrix("turn", (31, -12), sign * normal) for sign in (1, -1))
        assert one == pytest.approx(other), "a plane has no side"
        assert one[:3, :3] @ normal == pytest.approx(normal)


def test_a_click_does_nothing_and_the_rim_is_left_alone(context: FlatContext) -> None:
    assert do(Handle(), context, [px(0, 0), px(0.5, 0), px(0, 0)]) is None
    with pytest.raises(EngineError, match="not on the region"):
        do(Handle(), context, line((47, 0), (40, 0)))
    with pytest.raises(EngineError, match="too near"):
        do(Handle(), context, line((38, 0), (30, 0)))
    context.options = HandleOptions(radius=400.0)
    everything = do(Handle(), context, line((0, 0), (0, 9)))
    rim = np.linalg.norm(context.document.mesh.vertices[everything.patch], axis=1)
    assert rim.max() < 36, "three rings stay free"


def test_the_handle_works_at_the_level_of_the_slider(context: FlatContext) -> None:
    from dataclasses import replace

    draft = replace(context.document.draft, level=0.25)
    context.document = context.document.with_draft(draft)
    assert do(Handle(), context, line((0, 0), (9, 0))).level == 0.25
    assert context.view == from_above()


def test_across_a_plane_the_twin_goes_the_mirrored_way(context: FlatContext) -> None:
    """The far side moves as if its own image had been dragged, and the same recipe says so."""
    context = symmetric(context)
    context.options = HandleOptions(radius=12.0)
    step = do(Handle(), context, line((18, 4), (26, 12)))
    mesh = context.document.mesh
    assert len(step.twin) > 5
    assert (mesh.vertices[step.patch, 0] > 0).all()
    assert (mesh.vertices[step.twin, 0] < 0).all()
    after = step.apply(mesh).vertices
    way = after - mesh.vertices
    assert way[step.patch] == pytest.approx(np.tile([8.0, 8, 0], (len(step.patch), 1)), abs=1e-9)
    assert way[step.twin] == pytest.approx(np.tile([-8.0, 8, 0], (len(step.twin), 1)), abs=1e-9)
    again = HandleStep.from_json(step.to_json())
    assert (again.apply(mesh).vertices == after).all()


@pytest.mark.parametrize("keys", [{}, {"shift": True}, {"ctrl": True}])
def test_on_the_plane_a_handle_keeps_to_it(context: FlatContext, keys: dict[str, bool]) -> None:
    """A patch that meets its own image stays symmetric: no way across, no turn out of the plane."""
    context = symmetric(context)
    step = do(Handle(), context, line((0.5, 0), (15, 12)), **keys)
    assert len(step.twin) == 0
    mirror = np.diag([-1.0, 1, 1, 1])
    M = np.array(step.matrix).reshape(4, 4)
    assert mirror @ M @ mirror == pytest.approx(M, abs=1e-6)
    assert np.abs(M - np.eye(4)).max() > 0.01, "something moves all the same"


def test_a_step_kept_before_there_were_twins_is_read(context: FlatContext) -> None:
    step = do(Handle(), context, line((0, 0), (12, 5)))
    old = {name: value for name, value in step.to_json().items() if name not in ("twin", "mirror")}
    mesh = context.document.mesh
    assert (HandleStep.from_json(old).apply(mesh).vertices == step.apply(mesh).vertices).all()


def symmetric(context: FlatContext) -> FlatContext:
    """The context with edits mirrored across x = 0, on a plate whose two sides are alike."""
    from dataclasses import replace

    draft = context.document.draft
    options = replace(draft.options, mirror=(1.0, 0.0, 0.0, 0.0))
    context.document = context.document.with_draft(replace(draft, options=options))
    return context
