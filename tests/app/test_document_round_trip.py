"""A document through the window: all of it is there again; units, recent files, restoring."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog

from app.window import Window
from tests.app.driving import (
    Mouse,
    circle,
    picture,
    pixels,
    press,
    settled,
    through_menus,
)
from tests.app.test_variants import click_row, name, row, step
from tests.engine.histories import fingerprint

CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def safe(make_window, kept_safe) -> Callable[[], Window]:
    """Make windows that keep a journal, as the program does."""
    return lambda: kept_safe(make_window(size=(1100, 760)))


def answer_ask(window: Window, words: str) -> None:
    """Type a name into the field that asks for one."""
    QTest.keyClick(window.ask.line, Qt.Key.Key_A, CONTROL)
    QTest.keyClicks(window.ask.line, words)
    press(window.ask.line, Qt.Key.Key_Return)


def test_everything_is_there_again_after_saving_and_opening(
    safe, sphere_file: Path, qtbot, tmp_path: Path, monkeypatch, artefacts: Path
) -> None:
    document_file = tmp_path / "form.eigenform"
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_args: (str(sphere_file), ""))
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_args: (str(document_file), ""))
    window = safe()
    session = window.session
    press(window.viewport, Qt.Key.Key_O, CONTROL)
    qtbot.waitUntil(lambda: session.document is not None)
    qtbot.waitUntil(lambda: 0 in window.steps.pictures())
    step(window, qtbot, -0.4)
    name(window, qtbot, "Full", by_key=False)
    click_row(window, qtbot, "Opened")
    assert session.history.current_id == 0
    step(window, qtbot, 0.3)
    name(window, qtbot, "Slim", by_key=True)
    through_menus(window, "Region", "Keep this region")
    answer_ask(window, "Belly")
    press(window.viewport, Qt.Key.Key_3)
    qtbot.waitUntil(lambda: not window.viewport.moving)
    through_menus(window, "View", "Keep this view")
    answer_ask(window, "Side")
    through_menus(window, "File", "One unit is", "A centimetre")
    assert " cm" in window.status.figures
    press(window.viewport, Qt.Key.Key_7)
    qtbot.waitUntil(settled(window))
    qtbot.waitUntil(lambda: not window.viewport.moving)
    assert window.isWindowModified()
    press(window.viewport, Qt.Key.Key_S, CONTROL)
    qtbot.waitUntil(lambda: not window.isWindowModified())
    assert window.windowTitle().startswith("form.eigenform")

    kept = session.history.state()
    before, recipe = session.document, session.document.recipe.to_json()
    pictures, eye = dict(window.steps.pictures()), window.viewport.eye
    seen = pixels(window.viewport)
    window.close()

    again = safe()
    through_menus(again, "File", "Open recent", "form.eigenform")
    qtbot.waitUntil(lambda: again.session.document is not None)
    qtbot.waitUntil(settled(again))
    qtbot.waitUntil(lambda: not again.viewport.moving)
    document = again.session.document
    assert (document.original.vertices == before.original.vertices).all()
    assert (document.original.faces == before.original.faces).all()
    assert (document.mesh.vertices == before.mesh.vertices).all()
    assert document.recipe.to_json() == recipe
    assert fingerprint(again.session.history.state()) == fingerprint(kept)
    assert {one.name for one in again.session.history.moments.values()} >= {"Full", "Slim"}
    assert not row(again, "Full").icon(0).isNull()
    assert list(document.regions) == ["Belly"]
    assert (document.regions["Belly"] == before.regions["Belly"]).all()
    assert np.array_equal(document.views["Side"].matrix, before.views["Side"].matrix)
    assert document.unit == "cm"
    # Files of the thumbnails may be packed anew; their pictures are the same.
    assert again.steps.pictures().keys() == pictures.keys()
    for moment in pictures:
        assert again.steps._pictures[moment].toImage().size().width() > 0
    assert again.viewport.eye.same_as(eye)
    h = seen.shape[0] - 90
    assert np.abs(pixels(again.viewport)[:h] - seen[:h]).mean() < 1.0, "it looks as it did"
    assert not again.isWindowModified()
    picture(again, artefacts, "again")
    through_menus(again, "View", "Kept views", "Side", "Look from here")
    qtbot.waitUntil(lambda: not again.viewport.moving)
    assert again.viewport.cube.face_at(again.viewport.cube.rect().center().toPointF()) == "right"
    again.session.choose_region(None, "None")
    title = f"Belly, {len(document.regions['Belly']):,} vertices"
    through_menus(again, "Region", "Kept regions", title, "Choose")
    assert (again.session.document.draft.roi == before.regions["Belly"]).all()
    qtbot.waitUntil(settled(again))


def test_restoring_says_when_there_is_nothing_and_is_quiet_when_there_is(
    safe, sphere, sphere_file: Path, qtbot
) -> None:
    window = safe()
    with qtbot.waitSignal(window.safety.looked):
        pass
    window.files.open(sphere_file)
    qtbot.waitUntil(lambda: window.session.document is not None)
    qtbot.waitUntil(settled(window))
    with qtbot.waitSignal(window.safety.looked):
        through_menus(window, "File", "Restore unsaved work")
    assert window.hint.text == "There is no unsaved work to restore"
    step(window, qtbot, 0.3)
    window.files.open(sphere_file)
    qtbot.waitUntil(lambda: "are kept" in window.hint.text)
    qtbot.waitUntil(settled(window))
    with qtbot.waitSignal(window.safety.looked):
        through_menus(window, "File", "Restore unsaved work")
    assert "Looking" not in window.hint.text, "the bar says it all"
    bar = window.safety.bar
    assert bar.isVisible()
    qtbot.mouseClick(bar.buttons["Restore"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: bool(window.session.document.recipe.steps))
    qtbot.waitUntil(settled(window))
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.15))
    qtbot.waitUntil(settled(window))
