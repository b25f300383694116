"""Between two variants: ends to the bit, and form and detail each on its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine import EngineError, Mesh, Recipe, replay
from engine.arrays import F64, I64
from plugins.morph import MorphStep, morph_between
from plugins.registry import kinds
from tests.engine.shapes import plate, sphere


def within(mesh: Mesh) -> tuple[I64, F64]:
    """Ids inside a disc in the plate's middle, and a smooth bump that ends at its border."""
    away = np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1) / 0.38
    return np.flatnonzero(away < 1), np.clip(1 - away**2, 0, None) ** 3


@pytest.fixture(scope="module")
def flat() -> Mesh:
    """The one variant: a plate with fine waves along x in its middle."""
    return variant(0.0, (1, 0))


def variant(height: float, way: tuple[int, int]) -> Mesh:
    """A plate with a broad bump of a height, and fine waves running along a direction."""
    mesh = plate(41)
    x = mesh.vertices.copy()
    bump = within(mesh)[1]
    x[:, 2] += bump * (height + 0.012 * np.sin(18 * np.pi * (x[:, :2] @ np.array(way))))
    return mesh.with_vertices(x)


def test_the_ends_are_the_two_variants_to_the_bit(flat: Mesh) -> None:
    other = variant(0.2, (0, 1))
    step = morph_between(flat, other)
    assert (step.apply(flat).vertices == flat.vertices).all()
    end = MorphStep(step.roi, step.other, 1.0, 1.0)
    assert (end.apply(flat).vertices == other.vertices).all()


@pytest.mark.parametrize(("form", "detail"), [(1e-9, 0.0), (1.0, 1.0 - 1e-9)])
def test_nothing_jumps_at_the_ends(flat: Mesh, form: float, detail: float) -> None:
    other = variant(0.2, (0, 1))
    step = morph_between(flat, other)
    near = MorphStep(step.roi, step.other, form, detail).apply(flat)
    end = flat if form < 0.5 else other
    assert np.abs(near.vertices - end.vertices).max() < 1e-7


def test_form_and_detail_go_separately(flat: Mesh) -> None:
    """The form of one with the detail of the other is the plate made with just these."""
    other = variant(0.2, (0, 1))
    step = morph_between(flat, other)
    apart = np.abs(flat.vertices - other.vertices).max()
    for form, detail, expected in (
        (1.0, 0.0, variant(0.2, (1, 0))),
        (0.0, 1.0, variant(0.0, (0, 1))),
        (0.5, 0.0, variant(0.1, (1, 0))),
    ):
        got = MorphStep(step.roi, step.other, form, detail).apply(flat)
        assert np.abs(got.vertices - expected.vertices).max() < 0.12 * apart
        outside = np.setdiff1d(np.arange(flat.n), step.roi)
        assert (got.vertices[outside] == flat.vertices[outside]).all()


def test_detail_turns_with_the_form() -> None:
    """On a slope the waves stand off along the slope's normal, not along z."""
    goal = variant(0.3, (0, 0))
    pair = []
    for sign in (1, -1):
        start = variant(0.0, (sign, 0))
        step = morph_between(start, goal)
        pair.append(MorphStep(step.roi, step.other, 1.0, 0.0).apply(start).vertices)
    waves = (pair[0] - pair[1]) / 2
    size = np.linalg.norm(waves, axis=1)
    normals = goal.vertex_normals
    seen = (size > 0.003) & (normals[:, 2] < 0.8)
    assert seen.sum() > 50
    along = np.abs((waves * normals).sum(axis=1))[seen] / size[seen]
    assert np.median(along) > 0.95
    assert np.median(np.abs(waves[seen, 2]) / size[seen]) < 0.8, "straight up it would be 1"


def test_it_is_kept_in_a_recipe(flat: Mesh) -> None:
    other = variant(0.2, (0, 1))
    start = morph_between(flat, other)
    step = MorphStep(start.roi, start.other, 0.7, 0.2)
    recipe = Recipe(digest=flat.digest).with_step(step)
    again = Recipe.from_json(recipe.to_json(), kinds())
    assert (replay(again, flat).vertices == step.apply(flat).vertices).all()


def test_what_has_nothing_between_is_refused(flat: Mesh) -> None:
    with pytest.raises(EngineError, match="same form"):
        morph_between(flat, flat.with_vertices(flat.vertices.copy()))
    with pytest.raises(EngineError, match="different triangles"):
        morph_between(flat, plate(21))
    with pytest.raises(EngineError, match="another mesh"):
        MorphStep(np.array([3, 4]), (1.0, 2.0, 3.0)).apply(flat)
    with pytest.raises(EngineError, match="another mesh"):
        MorphStep(np.array([3, flat.n]), (1.0,) * 6).apply(flat)
    ball = sphere(3)
    step = morph_between(ball, ball.with_vertices(ball.vertices + 0.1))
    everywhere = MorphStep(step.roi, step.other, 0.5, 0.5)
    with pytest.raises(EngineError, match="stays the same"):
        everywhere.apply(ball)


def test_where_form_ends_is_the_persons_choice(flat: Mesh) -> None:
    """With more modes in the form, more of what is between the two moves with the form."""
    other = variant(0.2, (0, 1))
    step = morph_between(flat, other)
    assert step.modes == 16
    left = []
    for modes in (1, 16, 300):
        got = replace(step, form=1.0, detail=0.0, modes=modes).apply(flat)
        left.append(float(np.linalg.norm(got.vertices - other.vertices)))
    assert left[0] > 1.2 * left[1] > 2 * left[2]


def test_a_step_kept_before_the_cut_could_be_set_gives_the_same_bits(flat: Mesh) -> None:
    step = replace(morph_between(flat, variant(0.2, (0, 1))), form=0.7, detail=0.2)
    old = step.to_json()
    del old["modes"]
    assert (MorphStep.from_json(old).apply(flat).vertices == step.apply(flat).vertices).all()
