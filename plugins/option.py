"""Option: one thing that the person sets for a tool, as a field of its `Options`."""

from __future__ import annotations

from dataclasses import field
from typing import TypeVar

T = TypeVar("T")


def option(
    default: T,
    label: str,
    tip: str = "",
    *,
    low: float | None = None,
    high: float | None = None,
    step: float | None = None,
    unit: str | None = None,
    decimals: int | None = None,
    of_size: float | None = None,
) -> T:
    """Return a field of a frozen dataclass, with what its control in the window needs.

    Parameters
    ----------
    default : its type, or that of the field when it is a Literal, decides the kind of control.
    label, tip : a word or two, and a sentence.
    low, high, step, unit, decimals : of a number.
    of_size : of a length in mesh units: it begins as this share of the model's diagonal, and may
        be typed in any unit.
    """
    limits = {"min": low, "max": high, "step": step, "unit": unit}
    words = {"label": label, "tip": tip}
    limits |= {"decimals": decimals, "of_size": of_size}
    given = {name: value for name, value in limits.items() if value is not None}
    return field(default=default, metadata={**words, **given})
