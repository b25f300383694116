"""Enter and Esc where something is typed: they take or leave the text, not the edit."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDoubleSpinBox, QLineEdit

from app.window import Window
from tests.app.designing import curve, region, rest
from tests.app.driving import press, soon

pytestmark = pytest.mark.window


def editor(window: Window) -> QLineEdit:
    """Press F2 over the form; return the line that the name is typed into."""
    press(window.viewport, Qt.Key.Key_F2)
    tree = window.steps.tree
    assert soon(lambda: isinstance(window.focusWidget(), QLineEdit))
    return tree.findChild(QLineEdit)


def ready(window: Window, qtbot) -> None:
    """A curve is drawn, and Enter would apply it."""
    region(window, qtbot)
    curve(window, qtbot, 0.1)
    assert window.actions_table.qt["edit.apply"].isEnabled()


def test_enter_gives_the_name_and_applies_nothing(window: Window, qtbot) -> None:
    ready(window, qtbot)
    line = editor(window)
    QTest.keyClick(line, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(line, "Waist")
    QTest.keyClick(line, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: window.session.moment.name == "Waist")
    rest(window, qtbot)
    assert not window.session.document.recipe.steps
    assert not window.session.applying


def test_esc_leaves_the_name_and_drops_no_curve(window: Window, qtbot) -> None:
    ready(window, qtbot)
    line = editor(window)
    QTest.keyClicks(line, "Wai")
    QTest.keyClick(line, Qt.Key.Key_Escape)
    rest(window, qtbot)
    assert window.session.moment.name == ""
    assert len(window.session.document.draft.strokes) == 1
    press(window.viewport, Qt.Key.Key_Escape)
    assert not window.session.document.draft.strokes, "over the form it is one step back again"


def test_f2_shows_the_panel_that_is_folded_or_hidden(window: Window, qtbot) -> None:
    region(window, qtbot)
    window.steps._head.setChecked(False)
    press(window.viewport, Qt.Key.Key_Tab)
    assert not window.body.side.isVisible()
    assert editor(window).isVisible()


def test_esc_in_a_number_field_brings_the_number_back(window: Window, qtbot) -> None:
    region(window, qtbot)
    press(window.viewport, Qt.Key.Key_P)
    field = window.strip.findChild(QDoubleSpinBox, "option radius")
    field.setFocus()
    before = field.text()
    QTest.keyClick(field, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(field, "77")
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert field.text() == before
    assert window.toolbox.options_of("brush").radius == 24
    assert window.session.document.draft.roi is not None, "the region stays"
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert window.session.document.draft.roi is None, "with nothing typed it is the window's"


def test_an_equaliser_that_changes_nothing_makes_no_step(window: Window, qtbot) -> None:
    region(window, qtbot)
    window.actions_table.trigger("tool.equaliser")
    rest(window, qtbot)
    press(window.viewport, Qt.Key.Key_Return)
    rest(window, qtbot)
    assert not window.session.document.recipe.steps
    shown = window.viewport.vertices.copy()
    field = window.strip.findChild(QDoubleSpinBox, "option medium")
    field.setValue(2.5)
    qtbot.waitUntil(lambda: bool((window.viewport.vertices != shown).any()))
    field.setValue(1.0)
    qtbot.waitUntil(lambda: bool((window.viewport.vertices == shown).all()))
    field.setValue(2.0)
    press(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == 1)
