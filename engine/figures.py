"""Figures: numbers as a person reads them, whatever the unit of the model."""

from __future__ import annotations

import math

PLAIN = 1e-4, 1e9  # beyond these a row of zeros is harder to read than a power of ten


def figure(value: float, digits: int = 4) -> str:
    """Return a number with so many significant digits, no digit of its integer part left out.

    12.5, 0.0312, 5,972,000, 9.43e-10: thousands apart, no zeros that say nothing.

    Parameters
    ----------
    value : any finite number.
    digits : significant digits, at least 1.
    """
    size = abs(value)
    if size == 0.0:
        return "0"
    low, high = PLAIN
    if not low <= size < high:
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        return f"{_short(mantissa)}e{int(power)}"
    places = max(0, digits - 1 - math.floor(math.log10(size)))
    return _short(f"{value:,.{places}f}")


def _short(decimal: str) -> str:
    """Return a decimal number without zeros at its end."""
    return decimal.rstrip("0").rstrip(".") if "." in decimal else decimal
