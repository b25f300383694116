"""The first minute as the program starts it, and a pen that is followed at its own rate."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import QApplication

from app import start
from app.window import Window
from tests.app.driving import NONE, Mouse, Pen, bow, picture, press, settled, soon
from tests.pictures.first_edit import BELLY, LOWER, UPPER, circled


@pytest.fixture
def started(
    qapp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Callable[[Window], None]], None]:
    """Start the program as its command does, act in its window, and close it."""

    def run(act: Callable[[Window], None]) -> None:
        def loop() -> int:
            window = next(
                w for w in QApplication.topLevelWidgets() if isinstance(w, Window) and w.isVisible()
            )
            try:
                act(window)
            finally:
                window.safety.leave()
                window.close()
                QCoreApplication.processEvents()
            return 0

        monkeypatch.setattr(QApplication, "exec", staticmethod(loop))
        assert start.main() == 0

    monkeypatch.setattr(start, "application", lambda: qapp)
    monkeypatch.setattr(start, "state_folder", lambda: tmp_path / "state")
    return run


def test_the_first_start_shows_the_vase_and_three_steps_that_go_as_they_are_done(
    started, qtbot, artefacts: Path
) -> None:
    def first(window: Window) -> None:
        session, view, welcome = window.session, window.viewport, window.welcome
        assert soon(lambda: session.document is not None and settled(window)())
        assert session.document.name == "vase.ply"
        assert welcome.isVisible()
        assert view.overlay.inviting, "a dashed lasso invites"
        assert soon(lambda: not view.moving)
        picture(window, artefacts, "first start")
        Mouse().stroke(window, circled(view, BELLY))
        assert not view.overlay.inviting
        assert welcome.reached == 1
        assert soon(settled(window))
        Mouse().stroke(window, bow(view, UPPER, LOWER))
        assert welcome.reached == 2
        Mouse().stroke(window, bow(view, UPPER, LOWER, sag=-0.3))
        assert soon(settled(window))
        press(view, Qt.Key.Key_Return)
        assert soon(lambda: bool(session.document.recipe.steps))
        assert soon(settled(window))
        assert not welcome.isVisible()
        assert "on the right" in window.hint.text, "one line says where the steps are"

    def second(window: Window) -> None:
        assert soon(lambda: window.session.document is not None)
        assert not window.welcome.isVisible(), "never again"
        assert not window.viewport.overlay.inviting

    started(first)
    started(second)


def test_every_point_of_a_pen_is_in_the_stroke_and_the_form_is_not_drawn_for_it(
    window: Window, qtbot
) -> None:
    view, pen = window.viewport, Pen()
    qtbot.waitUntil(lambda: not view.moving)
    turn = np.linspace(0, 1.8 * np.pi, 500)
    path = [view.width() / 2, view.height() / 2] + 120.37 * np.column_stack(
        [np.cos(turn), np.sin(turn)]
    )
    rendered = view.renders
    pen.send(view, "press", path[0], NONE)
    for point in path[1:]:
        pen.send(view, "move", point, NONE)
    QCoreApplication.processEvents()
    drawn = view.overlay._ink.path
    assert len(drawn) == len(path), "none is left out"
    assert np.abs(drawn - path).max() < 0.01, "fractions of pixels are kept"
    assert view.renders - rendered <= 2, "of 500 points; what the window still had to draw may come"
    pen.send(view, "release", path[-1], NONE)
    qtbot.waitUntil(settled(window))
    assert window.session.document.draft.roi is not None
