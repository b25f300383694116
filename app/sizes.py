"""Sizes: how large a model is in words, and what its unit may be."""

from __future__ import annotations

import math

from engine import Document
from engine.figures import figure

UNIT_WORDS = {"mm": "millimetre", "cm": "centimetre", "m": "metre", "in": "inch"}
A_UNIT = {"mm": "a millimetre", "cm": "a centimetre", "m": "a metre", "in": "an inch"}
USUAL_MM = (8.0, 4000.0)
IN_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


def likely_unit(document: Document) -> str | None:
    """Return the unit that gives the model a usual size, or None when the present one does.

    A product is between 8 mm and 4 m across; of the metric units that make it so, the one that
    brings it nearest to the middle of that is the likeliest. Inches are chosen, never guessed.
    """
    size = document.mesh.diagonal
    low, high = USUAL_MM
    if low <= size * IN_MM[document.unit] <= high:
        return None
    sizes = {unit: size * IN_MM[unit] for unit in ("mm", "cm", "m")}
    usual = [unit for unit, mm in sizes.items() if low <= mm <= high]
    middle = math.log(low * high) / 2
    return min(usual, key=lambda unit: abs(math.log(sizes[unit]) - middle), default=None)


def _sides(document: Document) -> str:
    low, high = document.mesh.bounds
    return " × ".join(figure(side, 3) for side in high - low)


def size_words(document: Document) -> str:
    """Return the sentence that tells how large a model is."""
    return f"It measures {_sides(document)} {document.unit}."


def unit_question(document: Document) -> str:
    """Return the sentences that show a model's size, guess its unit and ask for it."""
    likely, taken = likely_unit(document) or document.unit, document.unit
    return (
        f"It measures {_sides(document)}. One unit is more likely {A_UNIT[likely]} than "
        f"{A_UNIT[taken]}. Which is it?"
    )
