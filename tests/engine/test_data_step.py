"""A step's JSON follows from its fields, and wrong data is refused with a sentence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine import DataStep, RecipeError, ids_from_text, ids_to_text
from engine.arrays import I64


@dataclass(frozen=True, eq=False)
class Example(DataStep):
    roi: I64
    size: float = field(default=1.0, metadata={"min": 0.0, "max": 10.0})
    count: int = 3
    rule: Literal["a", "b"] = "a"
    gains: tuple[float, ...] = ()
    on: bool = False
    kind: ClassVar[str] = "example"


@given(st.sets(st.integers(0, 5000), max_size=300))
def test_ids_come_back(ids: set[int]) -> None:
    array = np.array(sorted(ids), dtype=np.int64)
    back = ids_from_text(ids_to_text(array))
    assert back.dtype == np.int64
    assert (back == array).all()


def test_ids_come_back_once_each_and_ascending_however_they_were_written() -> None:
    assert ids_from_text("7 3-5 1 4-6 7").tolist() == [1, 3, 4, 5, 6, 7]
    assert len(ids_from_text("")) == 0


def test_ids_are_short_where_they_are_consecutive() -> None:
    assert ids_to_text(np.arange(5, 5000)) == "5-4999"


@pytest.mark.parametrize("text", ["a", "3-", "-4", "9-2", "1-2-3", "0-999999999999", "1e3", "٣-x"])
def test_bad_ids_are_refused(text: str) -> None:
    with pytest.raises(RecipeError):
        ids_from_text(text)


def test_many_long_ranges_are_refused_before_memory_is_taken() -> None:
    with pytest.raises(RecipeError, match="longer than any mesh"):
        ids_from_text(" ".join(["0-99999999"] * 1000))


def test_round_trip() -> None:
    step = Example(np.array([1, 2, 5]), 2.5, 7, "b", (1.0, 0.25), True)
    data = step.to_json()
    assert data["roi"] == "1-2 5"
    back = Example.from_json(data)
    assert (back.roi == step.roi).all()
    assert (back.size, back.count, back.rule, back.gains, back.on) == (2.5, 7, "b", (1, 0.25), True)


def test_absent_fields_keep_their_defaults() -> None:
    assert Example.from_json({"roi": "1"}).count == 3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"size": 11}, "between 0 and 10"),
        ({"size": float("nan")}, "finite"),
        ({"size": "1"}, "finite number"),
        ({"count": 1.5}, "int"),
        ({"on": 1}, "bool"),
        ({"rule": "c"}, "one of a, b"),
        ({"gains": 3}, "list of numbers"),
        ({"gains": [1, None]}, "finite number"),
        ({"roi": 5}, "vertex ids"),
        ({"colour": "red"}, "no field 'colour'"),
    ],
)
def test_wrong_data_is_refused(change: dict[str, object], says: str) -> None:
    with pytest.raises(RecipeError, match=says):
        Example.from_json({"roi": "1-3", **change})


def test_a_missing_field_is_named() -> None:
    with pytest.raises(RecipeError, match="lacks the field 'roi'"):
        Example.from_json({})
