"""Recipes: read, written, published as a schema, changed, replayed; absurd ones refused."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from engine import Mesh, Recipe, RecipeError, Run, SketchEdit, UnknownStep, replay

from .shapes import plate
from .test_edit import EDIT, PLATE, edits

SCHEMA = Path(__file__).resolve().parents[2] / "resources" / "recipe.schema.json"


@dataclass(frozen=True)
class Shift:
    """A step of a plugin: moves everything."""

    by: float
    kind: ClassVar[str] = "shift"
    title: ClassVar[str] = "Shift"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        return mesh.with_vertices(mesh.vertices * 2 + self.by)

    def to_json(self) -> dict[str, Any]:
        return {"by": self.by, "list": [1, {"deep": 2}]}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        return cls(float(data["by"]))


KINDS: dict[str, Any] = {"sketch": SketchEdit, "shift": Shift}
RECIPE = Recipe((EDIT, Shift(1.0), Shift(5.0)), PLATE.digest, frozenset({1}))


@pytest.fixture(scope="module")
def schema() -> Draft202012Validator:
    data = json.loads(SCHEMA.read_text("utf-8"))
    Draft202012Validator.check_schema(data)
    return Draft202012Validator(data)


@settings(max_examples=30, deadline=None)
@given(steps=st.lists(edits, max_size=3), muted=st.frozensets(st.integers(0, 2)))
def test_there_and_back(steps: list[SketchEdit], muted: frozenset[int]) -> None:
    recipe = Recipe(tuple(steps), "0" * 64, frozenset(i for i in muted if i < len(steps)))
    text = recipe.to_json()
    back = Recipe.from_json(text)
    assert back.to_json() == text
    assert back.muted == recipe.muted
    assert back.digest == recipe.digest


@settings(max_examples=30, deadline=None)
@given(steps=st.lists(edits, max_size=3))
def test_what_is_written_keeps_to_the_schema(steps: list[SketchEdit]) -> None:
    validator = Draft202012Validator(json.loads(SCHEMA.read_text("utf-8")))
    validator.validate(json.loads(Recipe(tuple(steps)).to_json()))


def test_steps_of_plugins_keep_to_the_schema(schema: Draft202012Validator) -> None:
    schema.validate(json.loads(RECIPE.to_json()))


@pytest.mark.parametrize(
    "change",
    [
        {"eigenform": 2}, {"eigenform": "1"}, {"steps": {}}, {"steps": [{}]}, {"mesh": 3},
        {"steps": [{"kind": "sketch"}]}, {"steps": [{"kind": 1}]}, {"steps": [[]]},
        {"steps": [{"kind": "sketch", "roi": "1", "level": 2, "strokes": []}]},
        {"steps": [{"kind": "sketch", "roi": "x", "level": 0, "strokes": []}]},
        {"steps": [{"kind": "sketch", "roi": "1", "level": 0, "strokes": [], "colour": 1}]},
        {"steps": [{"kind": "sketch", "roi": "1", "level": 0, "strokes": [], "muted": 1}]},
        {"steps": [{"kind": "sketch", "roi": "1", "level": 0, "strokes": [{"anchors": []}]}]},
        {"steps": [{"kind": "sketch", "roi": "1", "level": 0, "strokes": [],
                    "options": {"polish": -1}}]},
    ],
)  # fmt: skip
def test_schema_and_reader_refuse_the_same(
    schema: Draft202012Validator, change: dict[str, Any]
) -> None:
    data = {"eigenform": 1, "mesh": "", "steps": []} | change
    assert not schema.is_valid(data)
    with pytest.raises(RecipeError):
        Recipe.from_json(json.dumps(data))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        "3",
        '{"steps": 1}',
        '{"steps": []}',
        "[" * 100000,
        '{"eigenform": NaN, "steps": []}',
        '{"eigenform": true, "steps": []}',
        '{"eigenform": 0, "steps": []}',
        '{"eigenform": 99, "steps": []}',
        "\x00",
        "\ufeff{}",
    ],
)
def test_what_is_no_recipe_is_refused(text: str) -> None:
    with pytest.raises(RecipeError):
        Recipe.from_json(text)


@settings(max_examples=100, deadline=None)
@given(
    data=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["roi", "level", "strokes", "anchors", "view", "matrix", "size"])
                | st.sampled_from(["target", "options", "pins", "mirror", "weights", "by"]),
                inner,
                max_size=5,
            )
        ),
        max_leaves=12,
    )
)
def test_any_other_json_is_read_or_refused_and_never_crashes(data: Any) -> None:
    for kind in KINDS:
        step = {"kind": kind, **data} if isinstance(data, dict) else data
        text = json.dumps({"eigenform": 1, "steps": [step]})
        with suppress(RecipeError):
            Recipe.from_json(text, KINDS)


def test_the_message_names_the_step() -> None:
    data = json.loads(RECIPE.to_json())
    del data["steps"][1]["by"]
    with pytest.raises(RecipeError, match="Step 2"):
        Recipe.from_json(json.dumps(data), KINDS)


class TestReplay:
    def test_it_applies_what_is_not_muted(self) -> None:
        found = replay(RECIPE, PLATE)
        expected = Shift(5.0).apply(EDIT.apply(PLATE))
        assert (found.vertices == expected.vertices).all()

    def test_another_mesh_is_refused_unless_forced(self) -> None:
        other = plate(41, wave=0.016)
        with pytest.raises(RecipeError, match="--force"):
            replay(RECIPE, other)
        assert replay(RECIPE, other, force=True).n == other.n
        assert replay(replace(RECIPE, digest=""), other).n == other.n

    def test_an_unknown_step_is_kept_and_says_what_it_needs(self) -> None:
        text = RECIPE.to_json()
        read = Recipe.from_json(text)
        assert isinstance(read.steps[1], UnknownStep)
        assert read.to_json() == text
        with pytest.raises(RecipeError, match="shift"):
            replay(read, PLATE)
        muted = read.with_muted(2)
        assert (replay(muted, PLATE).vertices == EDIT.apply(PLATE).vertices).all()


class TestChanges:
    def test_muting(self) -> None:
        assert RECIPE.with_muted(0).muted == {0, 1}
        assert RECIPE.with_muted(1, False).muted == frozenset()

    def test_order(self) -> None:
        moved = RECIPE.with_moved(1, 2)
        assert moved.steps == (EDIT, RECIPE.steps[2], RECIPE.steps[1])
        assert moved.muted == {2}
        assert RECIPE.with_moved(2, 0).steps[0] is RECIPE.steps[2]
        assert RECIPE.without_step(0).muted == {0}
        assert RECIPE.without_step(1).muted == frozenset()

    @pytest.mark.parametrize("absent", [3, -1])
    def test_a_step_that_is_not_there_is_refused(self, absent: int) -> None:
        for change in (
            lambda: RECIPE.with_muted(absent),
            lambda: RECIPE.without_step(absent),
            lambda: RECIPE.with_moved(absent, 0),
            lambda: RECIPE.with_moved(0, absent),
        ):
            with pytest.raises(RecipeError, match=f"has 3 steps; there is none at .* {absent}"):
                change()

    def test_numbers(self) -> None:
        changed = RECIPE.with_value(0, "level", 0.25).with_value(0, "options.amount", 0.5)
        step = changed.steps[0]
        assert isinstance(step, SketchEdit)
        assert (step.level, step.options.amount) == (0.25, 0.5)
        assert changed.with_value(2, "by", 7).steps[2] == Shift(7.0)
        pulled = RECIPE.with_value(0, "strokes.0.target.3.1", 12.5).steps[0]
        assert isinstance(pulled, SketchEdit)
        assert pulled.strokes[0].target[3, 1] == 12.5
        unknown = Recipe((UnknownStep("far", {"a": [1, 2]}),)).with_value(0, "a.1", 9).steps[0]
        assert unknown.to_json() == {"a": [1, 9]}

    @pytest.mark.parametrize(
        ("position", "name", "value"),
        [
            (0, "level", 3),
            (0, "level", "x"),
            (0, "colour", 1),
            (0, "strokes.9.closed", True),
            (0, "level.x", 1),
            (2, "by", None),
            (7, "level", 0),
            (-1, "level", 0),
        ],
    )
    def test_wrong_numbers_are_refused(self, position: int, name: str, value: Any) -> None:
        with pytest.raises(RecipeError):
            RECIPE.with_value(position, name, value)

    def test_the_original_is_as_it_was(self) -> None:
        before = RECIPE.to_json()
        RECIPE.with_value(0, "options.pins", [1, 2])
        assert RECIPE.to_json() == before
        kept = RECIPE.steps[0]
        assert isinstance(kept, SketchEdit)
        assert np.array_equal(EDIT.strokes[0].target, kept.strokes[0].target)
