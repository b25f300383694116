"""Fields for a decimal number, and for a length with whatever unit it is typed."""

from __future__ import annotations

import re

from PySide6.QtCore import QLocale
from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

from app.sizes import IN_MM
from engine.figures import figure

PLACES = 12  # behind the point: what a model of a micrometre, in metres, still needs
LONGEST = 1e9
_LENGTH = re.compile(
    r"""\s*(?P<number>[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?)
    (?:\s*/\s*(?P<below>\d+))?\s*(?P<unit>mm|cm|m|inch|in|")?\s*""",
    re.VERBOSE | re.IGNORECASE,
)
_BEGUN = re.compile(r"""[-+\d.,e/\s]*(?:mm?|cm?|i|in|inch?|")?\s*""", re.IGNORECASE)


class DecimalField(QDoubleSpinBox):
    """A spin box that shows a decimal point and takes a comma for one.

    Qt's own takes whichever of the two the locale does not use for a separator of thousands, and
    reads 0.5 as 5 where the decimal sign is a comma.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        plain = QLocale.c()
        plain.setNumberOptions(
            QLocale.NumberOption.OmitGroupSeparator | QLocale.NumberOption.RejectGroupSeparator
        )
        self.setLocale(plain)

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Tell whether `text` is or may become a number; a comma becomes a point."""
        return super().validate(text.replace(",", "."), position)

    def valueFromText(self, text: str) -> float:
        """Return the number that `text` says."""
        return super().valueFromText(text.replace(",", "."))


class LengthField(DecimalField):
    """A length in four digits, however large the unit: 12.5 of a millimetre, 0.0125 of a metre.

    It may be typed in another unit than the model's, or as a fraction: 3 mm, 0.1 in, 1/8".
    """

    _unit = "mm"  # Qt asks for the value while the field is being made

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setDecimals(PLACES)
        self.setRange(0.0, LONGEST)
        self.setStepType(QDoubleSpinBox.StepType.AdaptiveDecimalStepType)

    def set_unit(self, unit: str) -> None:
        """Measure in "mm", "cm", "m" or "in"."""
        self._unit = unit
        if self.suffix() != f" {unit}":
            self.setSuffix(f" {unit}")

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Tell whether `text` is or may become a length."""
        typed = self._typed(text)
        if text == self.specialValueText():
            return super().validate(text, position)
        if _LENGTH.fullmatch(typed) is not None:
            inside = self.minimum() <= self.valueFromText(text) <= self.maximum()
            state = QValidator.State.Acceptable if inside else QValidator.State.Intermediate
            return state, text, position
        begun = _BEGUN.fullmatch(typed) is not None
        return (
            QValidator.State.Intermediate if begun else QValidator.State.Invalid,
            text,
            position,
        )

    def valueFromText(self, text: str) -> float:
        """Return the length that `text` says, in the model's unit."""
        found = _LENGTH.fullmatch(self._typed(text))
        if found is None:
            return super().valueFromText(text)
        value = float(found["number"].replace(",", ".")) / max(float(found["below"] or 1), 1.0)
        unit = (found["unit"] or self._unit).lower()
        return value * IN_MM["in" if unit in ('"', "inch") else unit] / IN_MM[self._unit]

    def _typed(self, text: str) -> str:
        """Return what stands before the unit that the field shows by itself."""
        shown = text.removesuffix(self.suffix()) if self.suffix() else text
        return shown if shown.strip() else text

    def textFromValue(self, value: float) -> str:
        """Return a length as it is read."""
        return figure(value).replace(",", "")
