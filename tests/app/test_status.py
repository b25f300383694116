"""The status bar: work that takes long is shown with a cross that stops it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.window import Window
from engine import Mesh
from plugins.api import DataStep
from tests.app.driving import picture, settled
from tests.program import PATIENCE

pytestmark = pytest.mark.window

GATES = (threading.Event(), threading.Event())  # let slow work end
STOPPED = threading.Event()


@dataclass(frozen=True, eq=False)
class SlowStep(DataStep):
    """Moves the form up when its gate is open, if it has one; it listens when it is cancelled."""

    gate: int
    kind: ClassVar[str] = "slow"
    label: ClassVar[str] = "Slow"

    def apply(self, mesh: Mesh, run: Any = None) -> Mesh:
        try:
            while self.gate >= 0 and not GATES[self.gate].wait(0.01):
                run.tick(0.25, "Raising")
        finally:
            STOPPED.set()
        return mesh.with_vertices(mesh.vertices + np.array([0.0, 0.0, 7.0]))


@pytest.fixture(autouse=True)
def _let_go() -> Iterator[None]:
    for event in (*GATES, STOPPED):
        event.clear()
    yield
    for gate in GATES:
        gate.set()


def test_a_preview_that_takes_long_can_be_stopped(window: Window, qtbot, artefacts) -> None:
    session, status = window.session, window.status
    before, shown = session.document, session.shown
    session.preview(SlowStep(0))
    cross = status._cross
    qtbot.waitUntil(cross.isVisible)
    qtbot.waitUntil(lambda: status._words.text() == "Raising")
    assert status._bar.value() == 250
    picture(window, artefacts, "status-preview")
    qtbot.mouseClick(cross, Qt.MouseButton.LeftButton)
    assert STOPPED.wait(PATIENCE)
    assert not cross.isVisible()
    assert session.document is before
    assert session.shown is shown
    assert "preview was stopped" in window.hint.text

    session.preview(SlowStep(-1))
    qtbot.waitUntil(lambda: session.shown is not shown)
    assert session.shown.vertices[0, 2] == before.mesh.vertices[0, 2] + 7.0, "the next is shown"


def test_a_preview_that_follows_the_hand_shows_no_bar(window: Window, qtbot) -> None:
    session, status = window.session, window.status
    session.preview(SlowStep(0))
    qtbot.waitUntil(status._cross.isVisible)
    session.preview(SlowStep(1))
    seen: list[tuple[bool, bool]] = []
    session.shown_changed.connect(
        lambda: seen.append((status._cross.isVisible(), session.jobs.busy("solve")))
    )
    GATES[0].set()
    qtbot.waitUntil(lambda: bool(seen))
    assert seen[0] == (False, True), "the form has just moved: nobody waits for it"
    qtbot.waitUntil(status._cross.isVisible)
    GATES[1].set()
    qtbot.waitUntil(settled(window))
    assert not status._cross.isVisible()
