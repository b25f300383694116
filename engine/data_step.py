"""DataStep: a step whose JSON follows from its fields, so that an author writes `apply` only."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self, get_args, get_origin, get_type_hints

import numpy as np

from engine.arrays import I64, frozen
from engine.errors import RecipeError
from engine.mesh import Mesh
from engine.run import Run


@dataclass(frozen=True, eq=False)
class DataStep:
    """Base of steps made of plain fields.

    A subclass is a frozen dataclass with fields of the types bool, int, float, str, Literal,
    `tuple[float, ...]` and `I64` (vertex ids). Field metadata "min" and "max" are limits. Vertex
    ids are written as ranges, "3-17 20 25", so that recipes stay readable.
    """

    kind: ClassVar[str]
    label: ClassVar[str] = ""

    @property
    def title(self) -> str:
        """A few words for the list of steps."""
        return self.label or self.kind

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the changed mesh."""
        raise TypeError(f"The step {type(self).__name__} does not say what it does.")

    def to_json(self) -> dict[str, Any]:
        """Return the fields as JSON data."""
        return {f.name: _written(getattr(self, f.name)) for f in dataclasses.fields(self)}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """Build the step from JSON data; absent fields keep their defaults.

        Raises
        ------
        RecipeError
            A field is unknown, missing, of another type, or outside its limits.
        """
        hints = get_type_hints(cls)
        fields = {f.name: f for f in dataclasses.fields(cls)}
        unknown = sorted(set(data) - set(fields))
        if unknown:
            raise RecipeError(
                f"The step “{cls.kind}” has no field {unknown[0]!r}. It has: {', '.join(fields)}."
            )
        values: dict[str, Any] = {}
        for name, field in fields.items():
            if name in data:
                where = f"The field {name!r} of the step “{cls.kind}”"
                values[name] = _read(hints[name], data[name], where)
                _check_limits(values[name], field.metadata, where)
            elif (
                field.default is dataclasses.MISSING
                and field.default_factory is dataclasses.MISSING
            ):
                raise RecipeError(f"The step “{cls.kind}” lacks the field {name!r}. Add it.")
        return cls(**values)


def ids_to_text(ids: I64) -> str:
    """Return ascending vertex ids as ranges: [3, 4, 5, 9] gives "3-5 9"."""
    if len(ids) == 0:
        return ""
    cuts = np.flatnonzero(np.diff(ids) != 1)
    first = ids[np.concatenate([[0], cuts + 1])]
    last = ids[np.concatenate([cuts, [len(ids) - 1]])]
    return " ".join(
        f"{a}" if a == b else f"{a}-{b}" for a, b in zip(first.tolist(), last.tolist(), strict=True)
    )


MOST_IDS = 100_000_000


def ids_from_text(text: str) -> I64:
    """Return the ascending vertex ids that `ids_to_text` wrote.

    Raises
    ------
    RecipeError
        The text is not made of ranges of whole numbers from 0 up.
    """
    try:
        pairs = [part.split("-") for part in text.split()]
        first = np.array([int(pair[0]) for pair in pairs], dtype=np.int64)
        last = np.array([int(pair[-1]) for pair in pairs], dtype=np.int64)
        good = all(len(pair) in (1, 2) for pair in pairs)
    except (ValueError, OverflowError):
        good = False
    if not good or (last < first).any() or (last > MOST_IDS).any():
        raise RecipeError(
            "A list of vertex ids cannot be read. Write ranges of whole numbers, such as “3-17 20”."
        )
    lengths = last - first + 1
    if lengths.sum() > MOST_IDS:
        raise RecipeError("A list of vertex ids is longer than any mesh. Check its ranges.")
    starts = np.repeat(first - np.concatenate([[0], np.cumsum(lengths)[:-1]]), lengths)
    ids: I64 = frozen(np.unique(starts + np.arange(lengths.sum())), np.int64)
    return ids


def _written(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return ids_to_text(value)
    return list(value) if isinstance(value, tuple) else value


def _read(hint: Any, value: Any, where: str) -> Any:
    origin = get_origin(hint)
    if origin is np.ndarray:
        if isinstance(value, list):
            value = " ".join(str(v) for v in value)
        if not isinstance(value, str):
            raise RecipeError(f"{where} must be vertex ids, such as “3-17 20”.")
        return ids_from_text(value)
    if origin is Literal:
        if value not in get_args(hint):
            choices = ", ".join(str(v) for v in get_args(hint))
            raise RecipeError(f"{where} must be one of {choices}.")
        return value
    if origin is tuple:
        if not isinstance(value, list):
            raise RecipeError(f"{where} must be a list of numbers.")
        kinds = get_args(hint)
        if len(kinds) == 2 and kinds[1] is Ellipsis:
            kinds = (kinds[0],) * len(value)
        if len(kinds) != len(value):
            raise RecipeError(f"{where} must be a list of {len(kinds)} numbers.")
        return tuple(_read(k, v, where) for k, v in zip(kinds, value, strict=True))
    if hint is float:
        if type(value) not in (int, float) or not math.isfinite(value):
            raise RecipeError(f"{where} must be a finite number.")
        return float(value)
    if hint in (int, bool, str) and type(value) is hint:
        return value
    raise RecipeError(f"{where} must be a {getattr(hint, '__name__', hint)}.")


def _check_limits(value: Any, limits: Any, where: str) -> None:
    numbers = value if isinstance(value, tuple) else (value,)
    for number in numbers:
        if not isinstance(number, int | float):
            return
        low, high = limits.get("min", -math.inf), limits.get("max", math.inf)
        if not low <= number <= high:
            raise RecipeError(f"{where} is {number:g}; it must lie between {low:g} and {high:g}.")
