"""Rail, panels, hint, status bar, keys from part to part, tooltips, remapping, scaling."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QMenu,
    QSlider,
    QToolButton,
    QWidget,
)

import engine
from app.look import DARK, LIGHT, Appearance
from app.walk import parts
from app.window import Window
from engine import Decomposition, Run
from tests.app.driving import (
    Mouse,
    bow,
    circle,
    cut,
    pixels,
    press,
    settled,
    soon,
    through_menus,
)

ROOT = Path(__file__).resolve().parents[2]
LEFT = Qt.MouseButton.LeftButton
RAIL = ("navigate", "lasso", "brush", "source", "target", "pin")


def region(window: Window, qtbot) -> None:
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    qtbot.waitUntil(settled(window))


def test_rail_canvas_and_panels_stand_where_they_should(make_window, sphere, qtbot) -> None:
    window = make_window(sphere, size=(1000, 720))
    rail, view, side = window.rail, window.viewport, window.body.side
    left, middle, right = (
        part.mapTo(window, part.rect().center()).x() for part in (rail, view, side)
    )
    assert left < middle < right
    assert view.width() * view.height() > 0.5 * window.width() * window.height()
    order = [window.level, window.edit, window.steps]
    tops = [panel.mapTo(window, panel.rect().topLeft()).y() for panel in order]
    assert tops == sorted(tops)
    region(window, qtbot)
    for name in RAIL:
        button = rail.buttons[name]
        if not button.isEnabled():
            assert name == "target", "there is no source yet"
            continue
        qtbot.mouseClick(button, LEFT)
        assert window.toolhost.active is window.toolbox.tools[name]
        assert button.isChecked()
    body = window.level.slider
    head = next(b for b in window.level.findChildren(QToolButton) if b.text() == "Level")
    assert body.isVisible()
    qtbot.mouseClick(head, LEFT)
    assert not body.isVisible()
    qtbot.mouseClick(head, LEFT)
    assert body.isVisible()


def test_the_hint_says_what_is_next_and_the_status_bar_how_it_stands(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    assert "Circle" in window.hint.text
    assert " mm" in window.status.figures
    Mouse().stroke(window, circle(view, 0, 0, 0.2))
    qtbot.waitUntil(lambda: session.decomposition is not None)
    assert "draw a curve" in window.hint.text
    assert f"region {len(session.document.draft.roi):,}" in window.status.figures
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0)))
    assert "where the curve should go" in window.hint.text
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0), -0.3))
    qtbot.waitUntil(settled(window))
    assert "Enter" in window.hint.text
    assert "target error" in window.status.figures
    qtbot.waitUntil(lambda: " modes" in window.status.figures)
    hint = window.hint
    assert view.rect().contains(hint.geometry())
    ground = pixels(hint)[3:-3, hint.width() // 2 :]
    assert ground.max() - ground.min() > 120, "words that stand out from their plate"


def test_the_cross_in_the_status_bar_stops_the_modes(
    make_window, qtbot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.app.driving import bumpy_sphere

    real = engine.decompose_stream

    def without_end(*given: Any, run: Run, **options: Any) -> Iterator[Decomposition]:
        """Give the base, and then work on until it is stopped."""
        yield next(real(*given, run=run, **options))
        while True:
            run.tick(0.5, "Modes")

    monkeypatch.setattr(engine, "decompose_stream", without_end)
    window = make_window(bumpy_sphere(9000))
    session, status = window.session, window.status
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.35))
    qtbot.waitUntil(status._cross.isVisible)
    qtbot.waitUntil(lambda: session.decomposition is not None)
    assert session.jobs.busy("decompose")
    qtbot.mouseClick(status._cross, LEFT)
    assert not session.jobs.busy("decompose")
    qtbot.waitUntil(lambda: not status._bar.isVisible())
    assert not session.decomposition.complete
    assert session.document.draft.roi is not None, "the region stays"


def test_the_colours_follow_the_system_until_some_are_chosen(
    make_window, sphere, qtbot, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = make_window(sphere, "system")
    hints = QApplication.styleHints()
    scheme = [Qt.ColorScheme.Light]
    monkeypatch.setattr(
        Appearance,
        "_resolved",
        lambda self, choice: {"dark": DARK, "light": LIGHT}.get(
            choice, LIGHT if scheme[0] == Qt.ColorScheme.Light else DARK
        ),
    )
    for scheme[0], theme in ((Qt.ColorScheme.Dark, DARK), (Qt.ColorScheme.Light, LIGHT)):
        hints.colorSchemeChanged.emit(scheme[0])
        assert soon(lambda theme=theme: window.palette().window().color().name() == theme.window)
        assert soon(lambda: not window.viewport.moving)
        corner = pixels(window.viewport)[4, 4]
        assert abs(int(corner.mean()) - int(sum(bytes.fromhex(theme.sky[1:])) / 3)) < 12
    through_menus(window, "View", "Colours", "Dark colours")
    assert soon(lambda: window.palette().window().color().name() == DARK.window)
    hints.colorSchemeChanged.emit(Qt.ColorScheme.Light)
    QTest.qWait(20)
    assert window.appearance.theme is DARK, "what was chosen stays"


def test_f6_and_tab_reach_every_control(window: Window, qtbot) -> None:
    region(window, qtbot)
    view = window.viewport
    every = parts(window)
    assert every == [view, window.rail, window.strip, window.level, window.edit, window.steps]
    view.setFocus()
    for part in [*every[1:], view]:
        press(QApplication.focusWidget(), Qt.Key.Key_F6)
        held = QApplication.focusWidget()
        assert part is held or part.isAncestorOf(held)
    press(view, Qt.Key.Key_F6, Qt.KeyboardModifier.ShiftModifier)
    assert window.steps.isAncestorOf(QApplication.focusWidget())

    kinds = (QAbstractButton, QAbstractSpinBox, QSlider, QComboBox)
    inside = [w for kind in kinds for w in window.body.side.findChildren(kind)]
    wanted = {w for w in inside if w.isVisible() and w.isEnabled() and not inner(w)}
    press(view, Qt.Key.Key_F6)
    for _ in every:
        if not window.level.isAncestorOf(QApplication.focusWidget()):
            press(QApplication.focusWidget(), Qt.Key.Key_F6)
    assert window.level.isAncestorOf(QApplication.focusWidget())
    reached: set[QWidget] = set()
    while window.body.side.isAncestorOf(held := QApplication.focusWidget()):
        assert held not in reached, "Tab goes round in a part of the panels"
        reached.add(held)
        press(held, Qt.Key.Key_Tab)
    missing = [w.accessibleName() or w.objectName() or str(w) for w in wanted - reached]
    assert not missing, f"Tab does not reach {missing}"


def inner(widget: QWidget) -> bool:
    """Whether a widget is a part of another control, as the field of a number is."""
    above = widget.parentWidget()
    return isinstance(above, (QAbstractSpinBox, QComboBox, QSlider)) or (
        widget.objectName().startswith("qt_") or type(widget).__name__.startswith("QLabeled")
    )


@pytest.mark.parametrize("title", ["File", "View", "Help"])
def test_alt_and_a_letter_open_a_menu(window: Window, qtbot, title: str) -> None:
    letter = Qt.Key(ord(title[0]))
    press(window.viewport, letter, Qt.KeyboardModifier.AltModifier)
    assert soon(lambda: isinstance(QApplication.activePopupWidget(), QMenu))
    menu = QApplication.activePopupWidget()
    assert menu.title().replace("&", "") == title
    menu.close()


def test_tooltips_tell_the_keys(window: Window) -> None:
    for name, tool in window.toolbox.tools.items():
        tip = window.rail.buttons[name].toolTip()
        assert tool.title in tip
        for key in window.actions_table.keys(f"tool.{name}")[:1]:
            assert f"({key})" in tip, f"{name} keeps its key for itself"


def test_keys_are_changed_in_the_sheet_by_pressing_others(
    window: Window, qtbot, artefacts: Path
) -> None:
    view = window.viewport
    control_alt = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    press(view, Qt.Key.Key_F1)
    keys = window._keys
    qtbot.waitUntil(keys.isVisible)
    QTest.keyClicks(keys.line, "wireframe")
    group = keys.tree.topLevelItem(0)
    assert (group.text(0), group.childCount()) == ("View", 1)
    qtbot.mouseClick(
        keys.tree.viewport(), LEFT, pos=keys.tree.visualItemRect(group.child(0)).center()
    )
    QTest.keyClick(keys.edit, Qt.Key.Key_D)
    qtbot.waitUntil(lambda: "already does" in keys.words.text())
    QTest.keyClick(keys.edit, Qt.Key.Key_J, control_alt)
    qtbot.waitUntil(lambda: "is now on" in keys.words.text())
    keys.grab().save(str(artefacts / "keys.png"))
    keys.close()
    press(view, Qt.Key.Key_W)
    assert not view.wireframe, "the old key does nothing"
    press(view, Qt.Key.Key_J, control_alt)
    assert view.wireframe
    assert (
        QKeySequence("Ctrl+Alt+J").toString() in window.actions_table.qt["view.wireframe"].toolTip()
    )
    press(view, Qt.Key.Key_F1)
    keys.choose("view.wireframe")
    qtbot.mouseClick(keys.reset, LEFT)
    keys.close()
    press(view, Qt.Key.Key_W)
    assert not view.wireframe


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_words_are_cut_in_a_small_window(make_window, sphere, qtbot, theme: str) -> None:
    window = make_window(sphere, theme)
    region(window, qtbot)
    assert not cut(window)
