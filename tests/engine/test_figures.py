"""Numbers are read the same way in millimetres, metres and inches."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.figures import figure


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0"),
        (288.2, "288.2"),
        (100.0, "100"),
        (0.0312, "0.0312"),
        (5972341.2, "5,972,341"),
        (-0.5, "-0.5"),
        (9.43e-10, "9.43e-10"),
        (1e30, "1e30"),
        (0.00012345, "0.0001234"),
    ],
)
def test_a_number_is_read_in_four_digits(value: float, words: str) -> None:
    assert figure(value) == words


@given(st.floats(1e-300, 1e300))
def test_no_figure_is_further_off_than_its_last_digit(value: float) -> None:
    assert float(figure(value).replace(",", "")) == pytest.approx(value, rel=5.1e-4)
