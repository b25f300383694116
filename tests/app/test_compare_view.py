"""Comparing never moves the camera: both look from where the person looked."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QMenu, QPushButton

import app.compare
from app.window import Window
from tests.app.designing import draw, enter, region
from tests.app.driving import bow, picture

pytestmark = pytest.mark.window


def test_the_view_stays_when_a_comparison_opens_swaps_and_closes(
    window: Window, qtbot, artefacts: Path
) -> None:
    view = window.viewport
    qtbot.keyClick(view, Qt.Key.Key_1)
    qtbot.waitUntil(lambda: not view.moving)
    region(window, qtbot)
    draw(window, qtbot, bow(view, (-0.12, 0.0), (0.12, 0.0)))
    draw(window, qtbot, bow(view, (-0.12, 0.0), (0.12, 0.0), 0.4))
    enter(window, qtbot)
    eye = view.eye
    window.compare_with(min(window.session.history.moments))
    qtbot.waitUntil(lambda: window.compare is not None and window.compare.isVisible())
    qtbot.wait(100)
    picture(window, artefacts, "comparing")
    assert view.eye.same_as(eye)
    assert same_way(window.compare.viewport.eye, eye)
    roi = window.session.document.draft.roi
    assert np.array_equal(window.compare.viewport.scene._region, roi), "tinted on both sides"
    click(window, qtbot, "Swap")
    qtbot.wait(100)
    assert view.eye.same_as(eye)
    assert same_way(window.compare.viewport.eye, eye)
    click(window, qtbot, "Close")
    qtbot.waitUntil(lambda: window.compare is None)
    assert view.eye.same_as(eye)


def test_the_menu_of_steps_stays_in_the_window_and_shows_them(make_window, sphere, qtbot) -> None:
    window = make_window(sphere, size=(1180, 800))
    region(window, qtbot)
    draw(window, qtbot, bow(window.viewport, (-0.12, 0.0), (0.12, 0.0)))
    draw(window, qtbot, bow(window.viewport, (-0.12, 0.0), (0.12, 0.0), 0.4))
    enter(window, qtbot)
    qtbot.waitUntil(lambda: len(window.steps.pictures()) == 2)
    qtbot.mouseClick(window.steps.compare, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: isinstance(QApplication.activePopupWidget(), QMenu))
    menu = QApplication.activePopupWidget()
    assert window.frameGeometry().contains(menu.geometry())
    (row,) = menu.actions()
    assert menu.actionGeometry(row).height() >= 30, "a picture that can be told from another"
    menu.close()


def test_what_is_kept_of_a_morph_leaves_the_keys_to_the_form(window: Window, qtbot) -> None:
    view = window.viewport
    region(window, qtbot)
    draw(window, qtbot, bow(view, (-0.12, 0.0), (0.12, 0.0)))
    draw(window, qtbot, bow(view, (-0.12, 0.0), (0.12, 0.0), 0.4))
    enter(window, qtbot)
    window.compare_with(min(window.session.history.moments))
    qtbot.waitUntil(lambda: window.compare is not None and window.compare.isVisible())
    morph = window.compare.morph
    morph.form.setValue(50)
    morph.keep.setFocus()
    qtbot.mouseClick(morph.keep, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == 2)
    assert window.focusWidget() is view


def click(window: Window, qtbot, words: str) -> None:
    buttons = window.compare.findChildren(QPushButton)
    qtbot.mouseClick(next(b for b in buttons if b.text() == words), Qt.MouseButton.LeftButton)


def same_way(one, other) -> bool:
    """Whether both look the same way; each has its own scale."""
    return bool(np.allclose(one.axes, other.axes))


def test_a_heavy_form_beside_is_made_ready_in_the_engines_thread(
    window: Window, qtbot, monkeypatch
) -> None:
    region(window, qtbot)
    draw(window, qtbot, bow(window.viewport, (-0.12, 0.0), (0.12, 0.0)))
    draw(window, qtbot, bow(window.viewport, (-0.12, 0.0), (0.12, 0.0), 0.4))
    enter(window, qtbot)
    where: dict[str, set[int]] = {"prepare": set(), "morph_between": set()}

    def noted(name: str):
        done = getattr(app.compare, name)

        def call(*given):
            where[name].add(threading.get_ident())
            return done(*given)

        return call

    for name in where:
        monkeypatch.setattr(app.compare, name, noted(name))
    monkeypatch.setattr(app.compare, "is_heavy", lambda _mesh: True)
    window.compare_with(min(window.session.history.moments))
    compare = window.compare
    qtbot.waitUntil(lambda: compare.moment is not None and compare._step is not None)
    assert compare.viewport.form is compare.moment.document.mesh
    assert all(threads and threading.get_ident() not in threads for threads in where.values())
    compare.morph.form.setValue(50)
    qtbot.waitUntil(lambda: window.session.shown is not window.session.document.mesh)
