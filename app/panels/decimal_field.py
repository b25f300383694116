"""A field for a decimal number, typed with a point or a comma whatever the locale."""

from __future__ import annotations

from PySide6.QtCore import QLocale
from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

from engine.figures import figure

PLACES = 12  # behind the point: what a model of a micrometre, in metres, still needs
LONGEST = 1e9


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
    """A length in four digits, however large the unit: 12.5 of a millimetre, 0.0125 of a metre."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setDecimals(PLACES)
        self.setRange(0.0, LONGEST)
        self.setStepType(QDoubleSpinBox.StepType.AdaptiveDecimalStepType)

    def textFromValue(self, value: float) -> str:
        """Return a length as it is read."""
        return figure(value).replace(",", "")
