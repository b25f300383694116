"""A recipe put on a mesh with other triangles does the same there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from engine import (
    Alignment,
    DataStep,
    EditOptions,
    Mesh,
    Recipe,
    RecipeError,
    Run,
    SketchEdit,
    UnknownStep,
    align,
    replay,
    transfer,
)
from engine.arrays import F64, I64

from .shapes import inner, plate, sphere
from .test_edit import SIDE, lifted, row_of

COARSE, FINE = plate(31, wave=0.015), plate(47, wave=0.015, jitter=0.3)
EDIT = SketchEdit(
    inner(COARSE, 0.12, 0.88), 0.0, (lifted(COARSE, SIDE, row_of(COARSE, 0.5, 0.25, 0.75), 60),)
)
RECIPE = Recipe((EDIT,), COARSE.digest)


@dataclass(frozen=True, eq=False)
class Raise(DataStep):
    """A plugin's step: lifts some vertices."""

    roi: I64
    by: float = 0.1
    kind = "raise"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        x = mesh.vertices.copy()
        x[self.roi, 2] += self.by
        return mesh.with_vertices(x)


def heights(mesh: Mesh) -> F64:
    """Height of a surface over a grid of places inside the plate."""
    places = np.stack(np.meshgrid(np.linspace(0.2, 0.8, 25), np.linspace(0.2, 0.8, 25)), -1)
    away, near = cKDTree(mesh.vertices[:, :2]).query(places.reshape(-1, 2), k=3)
    weight = 1 / (away + 1e-9)
    return np.asarray((mesh.vertices[near, 2] * weight).sum(axis=1) / weight.sum(axis=1))


def lumpy() -> Mesh:
    """A form that fits on itself in one way only."""
    ball = sphere(3)
    lump = ball.vertices * [1.0, 1.4, 2.0]
    lump[:, 0] += 0.4 * np.exp(-4 * ((lump - [0.8, 0.5, 0.9]) ** 2).sum(axis=1))
    return Mesh(lump, ball.faces)


def moved(mesh: Mesh) -> tuple[Mesh, F64]:
    """The mesh elsewhere, turned, and three times as large; and the way there."""
    R = 3.0 * Rotation.from_rotvec([0.4, -0.8, 2.0]).as_matrix()
    shift = np.array([10.0, -4.0, 2.0])
    there = np.eye(4)
    there[:3, :3], there[:3, 3] = R, shift
    return Mesh(mesh.vertices @ R.T + shift, mesh.faces), there


def test_on_a_finer_mesh_the_form_is_the_same() -> None:
    found = transfer(RECIPE, COARSE, FINE, Alignment(np.eye(4), 0.0))
    after = replay(found.recipe, FINE)
    expected = replay(RECIPE, COARSE)
    rise = heights(expected) - heights(COARSE)
    assert rise.max() > 0.05
    apart = heights(after) - heights(FINE) - rise
    assert np.abs(apart).max() < 0.15 * rise.max()
    assert np.sqrt((apart**2).mean()) < 0.05 * rise.max()
    assert found.recipe.digest == FINE.digest
    assert found.report.lost_vertices == found.report.lost_anchors == 0
    assert 0 < found.report.rms < 0.03
    step = found.recipe.steps[0]
    assert isinstance(step, SketchEdit)
    assert len(step.strokes[0].anchors) > len(EDIT.strokes[0].anchors)


def test_on_itself_it_is_the_same_edit() -> None:
    found = transfer(RECIPE, COARSE, COARSE, Alignment(np.eye(4), 0.0))
    step = found.recipe.steps[0]
    assert isinstance(step, SketchEdit)
    assert (step.roi == EDIT.roi).all()
    assert (step.strokes[0].anchors == EDIT.strokes[0].anchors).all()
    assert np.abs(step.strokes[0].target - EDIT.strokes[0].target).max() < 1e-6


def test_elsewhere_and_at_another_size() -> None:
    other, there = moved(FINE)
    found = transfer(RECIPE, COARSE, other, Alignment(np.linalg.inv(there), 0.0))
    assert found.report.scale == pytest.approx(3, rel=1e-6)
    after = replay(found.recipe, other).vertices
    back = (after - there[:3, 3]) @ np.linalg.inv(there[:3, :3]).T
    here = replay(transfer(RECIPE, COARSE, FINE, Alignment(np.eye(4), 0.0)).recipe, FINE).vertices
    assert np.abs(back - here).max() < 1e-7
    assert any("3 times" in line for line in found.report.lines())


def test_the_alignment_is_found() -> None:
    mesh = lumpy()
    other, there = moved(mesh)
    found = align(other, mesh)
    assert np.abs(found.matrix @ there - np.eye(4)).max() < 1e-3
    assert found.scale == pytest.approx(1 / 3, rel=1e-3)
    assert found.rms < 1e-3
    assert align(mesh, mesh).rms == pytest.approx(0, abs=1e-12)


def test_without_an_alignment_the_best_one_is_taken() -> None:
    mesh = lumpy()
    roi = np.flatnonzero(mesh.vertices[:, 0] > 0.7)
    found = transfer(Recipe((Raise(roi),)), mesh, moved(mesh)[0])
    step = found.recipe.steps[0]
    assert isinstance(step, Raise)
    assert (step.roi == roi).all()
    assert found.report.scale == pytest.approx(3, rel=1e-3)


def test_steps_of_plugins_are_carried_and_meet_the_changed_shape() -> None:
    recipe = Recipe((EDIT, Raise(inner(COARSE, 0.4, 0.6)), UnknownStep("far")), "", frozenset({1}))
    with pytest.raises(RecipeError, match="far"):
        transfer(recipe, COARSE, FINE, Alignment(np.eye(4), 0.0))
    two = recipe.without_step(2)
    found = transfer(two, COARSE, FINE, Alignment(np.eye(4), 0.0)).recipe
    step = found.steps[1]
    assert isinstance(step, Raise)
    x = FINE.vertices[step.roi]
    assert x[:, 0].min() > 0.35
    assert x[:, 0].max() < 0.65
    assert found.muted == {1}
    assert found.digest == ""


def test_pins_and_mirror_are_carried() -> None:
    options = EditOptions(
        pins=tuple(row_of(COARSE, 0.7, 0.3, 0.6).tolist()), mirror=(0.0, 1, 0, 0.5)
    )
    edit = SketchEdit(
        EDIT.roi, 0.0, (lifted(COARSE, SIDE, row_of(COARSE, 0.3, 0.3, 0.7), 30),), options
    )
    other, there = moved(FINE)
    found = transfer(Recipe((edit,)), COARSE, other, Alignment(np.linalg.inv(there), 0.0))
    carried = found.recipe.steps[0]
    assert isinstance(carried, SketchEdit)
    plane = np.array(carried.options.mirror)
    on_it = np.array([[0.2, 0.5, 0.1], [0.9, 0.5, 0.0]]) @ there[:3, :3].T + there[:3, 3]
    assert np.allclose(on_it @ plane[:3], plane[3])
    assert len(carried.options.pins) >= 5
    rise = (replay(found.recipe, other).vertices - other.vertices) @ there[:3, 2] / 9
    assert rise.max() > 0.02


def test_pins_of_another_region_are_not_lost_but_left() -> None:
    """The window keeps them among the options; what they would hold is not in this region."""
    outside = int(np.flatnonzero(~np.isin(np.arange(COARSE.n), EDIT.roi))[0])
    within = int(EDIT.roi[0])
    edit = SketchEdit(EDIT.roi, 0.0, (), EditOptions(pins=(outside, within)))
    found = transfer(Recipe((edit,)), COARSE, COARSE, Alignment(np.eye(4), 0.0))
    assert found.recipe.steps[0].options.pins == (within,)
    assert found.report.lost_anchors == 0


def test_a_pin_on_the_twins_side_is_carried() -> None:
    half = inner(COARSE, 0.12, 0.88)
    half = half[COARSE.vertices[half, 1] < 0.4]
    far = row_of(COARSE, 0.7, 0.3, 0.6)[:1]
    options = EditOptions(pins=tuple(far.tolist()), mirror=(0.0, 1, 0, 0.5))
    edit = SketchEdit(half, 0.0, (), options)
    found = transfer(Recipe((edit,)), COARSE, COARSE, Alignment(np.eye(4), 0.0))
    assert found.recipe.steps[0].options.pins == tuple(far.tolist())
    assert found.report.lost_anchors == 0


def test_what_has_no_counterpart_is_counted() -> None:
    """The new mesh ends at x = 0.65: one of four pins and the last fifth of the curve are lost."""
    inside = COARSE.vertices[:, 0] < 0.65
    faces = COARSE.faces[inside[COARSE.faces].all(axis=1)]
    ids = np.unique(faces)
    half = Mesh(COARSE.vertices[ids], np.searchsorted(ids, faces))
    pins = row_of(COARSE, 0.3, 0.3, 0.8)[[0, 2, 5, -1]].tolist()
    still = Alignment(np.eye(4), 0.0)
    bare = SketchEdit(EDIT.roi, 0.0, (), EditOptions(pins=tuple(pins)))
    assert transfer(Recipe((bare,)), COARSE, half, still).report.lost_anchors == 0.25
    report = transfer(RECIPE, COARSE, half, still).report
    assert 0.1 < report.lost_anchors < 0.25
    assert 0.2 < report.lost_vertices < 0.4
    assert f"{report.lost_anchors:.1%} of the anchors have no counterpart." in report.lines()


def test_another_form_is_refused() -> None:
    far = Mesh(FINE.vertices + np.array([0, 0, 5.0]), FINE.faces)
    with pytest.raises(RecipeError, match="no counterpart"):
        transfer(RECIPE, COARSE, far, Alignment(np.eye(4), 0.0))
