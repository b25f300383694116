"""Vary: numbers of a recipe that a sweep changes, named as a person would name them."""

from __future__ import annotations

import copy
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine import EngineError

BLEND = "blend"
"""The one name that is not in the recipe: 0 is the mesh as it was, 1 the recipe's result."""

MOST_VARIANTS = 10_000


@dataclass(frozen=True)
class Variation:
    """One number and the values it takes.

    Parameters
    ----------
    name : `blend`, a field of the steps (`level`, `amount`), or with the number of a step and
        dots (`2.level`, `options.amount`, `1.gains.0`).
    values : the values in order.
    """

    name: str
    values: tuple[float, ...]

    @classmethod
    def parse(cls, text: str) -> Variation:
        """Read `NAME=FROM:TO:COUNT`, or `NAME=A,B,C` for single values.

        Raises
        ------
        EngineError
            The text has another form, or a number is not finite.
        """
        name, equals, numbers = text.partition("=")
        try:
            if not equals or not name.strip():
                raise ValueError
            if ":" in numbers:
                start, stop, count = numbers.split(":")
                if not 1 <= int(count) <= MOST_VARIANTS:
                    raise ValueError
                values = np.linspace(float(start), float(stop), int(count))
            else:
                values = np.array([float(v) for v in numbers.split(",")])
            if not np.isfinite(values).all():
                raise ValueError
        except ValueError as error:
            raise EngineError(
                f"“{text}” does not say what to vary. Write NAME=FROM:TO:COUNT, "
                "for example level=0:0.5:6, or NAME=A,B,C."
            ) from error
        return cls(name.strip(), tuple(float(v) for v in values))


def combinations(variations: Sequence[Variation]) -> Iterator[dict[str, float]]:
    """Yield every combination of the values, the last name changing fastest.

    Raises
    ------
    EngineError
        There would be more than `MOST_VARIANTS`, or a name stands twice.
    """
    names = [v.name for v in variations]
    if len(set(names)) != len(names):
        raise EngineError("A name is varied twice. Give each name once.")
    total = int(np.prod([len(v.values) for v in variations], dtype=np.int64))
    if total > MOST_VARIANTS:
        raise EngineError(
            f"The sweep would make {total} variants; {MOST_VARIANTS} is the limit. "
            "Use fewer values."
        )
    for values in itertools.product(*(v.values for v in variations)):
        yield dict(zip(names, values, strict=True))


def varied(recipe: dict[str, Any], values: dict[str, float]) -> dict[str, Any]:
    """Return a copy of a recipe's JSON data with the named numbers replaced.

    A name without a step's number changes every step that has such a number. `blend` is not in the
    recipe and is passed over.

    Raises
    ------
    EngineError
        No step has a number of that name.
    """
    changed = copy.deepcopy(recipe)
    for name, value in values.items():
        if name == BLEND:
            continue
        numbered = re.match(r"(\d+)\.(.+)", name)
        steps = changed["steps"]
        field = name
        if numbered:
            field = numbered.group(2)
            position = int(numbered.group(1)) - 1
            steps = steps[position : position + 1] if position >= 0 else []
        hits = sum(_set(step, field.split("."), value) for step in steps)
        if hits == 0:
            raise EngineError(
                f"No step of the recipe has a number called “{name}”. It has: "
                + ", ".join(sorted(number_names(recipe)))
                + "."
            )
    return changed


def _set(data: Any, path: list[str], value: float) -> int:
    """Set the number at `path`, or at `options.path`; return how many were set."""
    for prefix in ([], ["options"]):
        place = data
        *heads, last = [*prefix, *path]
        try:
            for key in heads:
                place = place[int(key)] if isinstance(place, list) else place[key]
            key = int(last) if isinstance(place, list) else last
            old = place[key]
        except (KeyError, IndexError, TypeError, ValueError):
            continue
        if isinstance(old, bool) or not isinstance(old, int | float):
            continue
        place[key] = round(value) if isinstance(old, int) and value == round(value) else value
        return 1
    return 0


def number_names(recipe: dict[str, Any]) -> set[str]:
    """Return the names of all single numbers in the steps of a recipe, and `blend`."""
    names = {BLEND}
    for step in recipe["steps"]:
        for key, value in {**step, **step.get("options", {})}.items():
            if isinstance(value, int | float) and not isinstance(value, bool):
                names.add(key)
    return names


def file_stem(values: dict[str, float]) -> str:
    """Return a file name for a variant, such as `level=0.25_amount=1`."""
    return "_".join(f"{re.sub(r'[^A-Za-z0-9.-]', '-', n)}={v:.6g}" for n, v in values.items())
