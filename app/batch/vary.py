"""Vary: numbers of a recipe that a sweep changes, named as a person would name them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from engine import EngineError, Recipe, RecipeError

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
    total = math.prod(len(v.values) for v in variations)
    if total > MOST_VARIANTS:
        raise EngineError(
            f"The sweep would make {total:,} variants; {MOST_VARIANTS:,} is the limit. "
            "Use fewer values."
        )
    for values in itertools.product(*(v.values for v in variations)):
        yield dict(zip(names, values, strict=True))


def varied(recipe: Recipe, values: dict[str, float]) -> Recipe:
    """Return a recipe with the named numbers replaced.

    A name without a step's number changes every step that has such a number, as a field or among
    its options. `blend` is not in the recipe and is passed over.

    Raises
    ------
    EngineError
        No step has a number of that name, or takes that value.
    """
    for name, value in values.items():
        if name == BLEND:
            continue
        numbered = re.fullmatch(r"(\d+)\.(.+)", name)
        field = numbered.group(2) if numbered else name
        places = [int(numbered.group(1)) - 1] if numbered else list(range(len(recipe.steps)))
        refusals: list[str] = []
        changed = False
        for place in places:
            if not 0 <= place < len(recipe.steps):
                continue
            made = _changed(recipe, place, field, value, refusals)
            changed = changed or made is not recipe
            recipe = made
        if not changed:
            reasons = dict.fromkeys(refusals) or [f"The recipe has {len(recipe.steps)} steps."]
            raise EngineError(
                f"No step of the recipe takes a number called “{name}” of {value:g}. "
                + " ".join(reasons)
            )
    return recipe


def _changed(recipe: Recipe, place: int, field: str, value: float, refusals: list[str]) -> Recipe:
    """Return the recipe with one number of one step changed, or itself with the refusal noted."""
    whole = [int(value)] if value == int(value) else []
    for name in (field, f"options.{field}"):
        for number in (value, *whole):
            try:
                return recipe.with_value(place, name, number)
            except RecipeError as error:
                refusals.append(str(error))
    return recipe


def file_stem(values: dict[str, float]) -> str:
    """Return a file name for a variant, such as `level=0.25_amount=1`."""
    return "_".join(f"{re.sub(r'[^A-Za-z0-9.-]', '-', n)}={v:.6g}" for n, v in values.items())
