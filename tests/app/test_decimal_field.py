"""Numbers are typed with a point or a comma, under any locale of the desktop."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QLocale, Qt

from app.panels.decimal_field import DecimalField, LengthField


@pytest.mark.parametrize("country", ["C", "en_US", "de_DE", "fr_FR"])
@pytest.mark.parametrize("typed", ["0.5", "0,5", ".5", ",5"])
def test_a_point_and_a_comma_are_the_same(qtbot, country: str, typed: str) -> None:
    before = QLocale()
    QLocale.setDefault(QLocale(country))
    try:
        field = DecimalField()
    finally:
        QLocale.setDefault(before)
    qtbot.addWidget(field)
    field.setRange(0.0, 5000.0)
    field.setSuffix(" mm")
    field.setValue(1234.25)
    assert field.text() == "1234.25 mm"
    field.selectAll()
    qtbot.keyClicks(field, typed)
    field.interpretText()
    assert field.value() == 0.5


@pytest.mark.parametrize(
    ("length", "words"), [(12.5, "12.5"), (0.003, "0.003"), (5972341.2, "5972341"), (3e-7, "3e-7")]
)
def test_a_length_is_told_in_any_unit(qtbot, length: float, words: str) -> None:
    field = LengthField()
    qtbot.addWidget(field)
    field.setSuffix(" m")
    field.setSpecialValueText("none")
    field.setValue(length)
    assert field.text() == f"{words} m"
    field.selectAll()
    qtbot.keyClicks(field, "0,004")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert field.value() == 0.004
    field.stepUp()
    assert 0.004 < field.value() < 0.005, "a step of the arrows is a tenth, not a whole metre"
