"""Numbers are typed with a point or a comma, under any locale of the desktop."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QLocale

from app.panels.decimal_field import DecimalField


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
