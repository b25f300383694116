"""Lengths in the window: in the unit of the model, typed in whatever unit the person thinks in."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app.panels.decimal_field import LengthField
from app.window import Window
from tests.app.designing import enter, modes, option, region, rest, typed
from tests.app.driving import LEFT

pytestmark = pytest.mark.window


@pytest.mark.parametrize(
    ("unit", "words", "length"),
    [
        ("mm", "3 mm", 3.0),
        ("mm", "0.1 in", 2.54),
        ("mm", '1/8"', 3.175),
        ("mm", "0,25cm", 2.5),
        ("in", "25.4 mm", 1.0),
        ("m", "30mm", 0.03),
        ("cm", "4", 4.0),
    ],
)
def test_a_length_may_be_typed_in_any_unit(qtbot, unit: str, words: str, length: float) -> None:
    field = LengthField()
    qtbot.addWidget(field)
    field.set_unit(unit)
    field.setValue(7.0)
    field.selectAll()  # Qt leaves the unit that is shown: it stays behind what is typed
    QTest.keyClicks(field, words)
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert field.value() == pytest.approx(length, rel=1e-9)
    assert field.text().endswith(f" {unit}")


@pytest.mark.parametrize(
    ("words", "length"), [("3 furlongs", 3.0), ("1/", 1.0), ("mm", 7.0), ("--3", 7.0)]
)
def test_what_is_no_length_is_not_taken(qtbot, words: str, length: float) -> None:
    field = LengthField()
    qtbot.addWidget(field)
    field.setValue(7.0)
    field.selectAll()
    QTest.keyClicks(field, words)
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert field.value() == length
    assert field.text() == f"{length:g}"


def test_the_smallest_feature_is_typed_in_inches(window: Window, qtbot) -> None:
    region(window, qtbot)
    modes(window, qtbot)
    known, field = window.session.decomposition, window.level.feature
    size = 0.5 * (known.wavelength(2) + known.wavelength(known.k))
    typed(qtbot, field, f"{size / 25.4:.6f} in")
    rest(window, qtbot)
    k = known.mode_count(window.session.document.draft.level)
    assert k == known.mode_count_at(size)
    assert field.text().endswith(" mm"), "and told in the unit of the model"


def test_a_tool_measures_in_the_unit_of_the_model(make_window, sphere, qtbot) -> None:
    metres = sphere.with_vertices(sphere.vertices / 1000)
    window = make_window(metres, size=(1180, 800))
    window.session.set_unit("m")
    roi = region(window, qtbot)
    qtbot.mouseClick(window.rail.buttons["inflate"], LEFT)
    field = option(window, "distance")
    assert field.suffix() == " m"
    assert 0 < field.value() < 0.02 * metres.diagonal, "it begins with what suits the model"
    typed(qtbot, field, "6 mm")
    rest(window, qtbot)
    before = window.session.document.mesh.vertices[roi]
    enter(window, qtbot)
    way = np.linalg.norm(window.session.document.mesh.vertices[roi] - before, axis=1).max()
    assert way == pytest.approx(0.006, rel=0.05)
