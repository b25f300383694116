"""A step in a window that keeps a journal, and the kill of its program."""

from __future__ import annotations

import numpy as np

from app.window import Window
from engine import Draft, HistoryState, UnknownStep
from tests.app.driving import settled


def work(window: Window, qtbot) -> HistoryState:
    """Do one step, as a plugin's tool does it, and return the state after it."""
    session = window.session
    roi = np.arange(200, 420)
    session.change(session.document.with_draft(Draft(roi, 0.3)), "Region")
    moved = session.document.mesh.vertices.copy()
    moved[roi] *= 1.01
    document = session.document.with_step(
        UnknownStep("other", {"roi": roi.tolist()}), session.document.mesh.with_vertices(moved)
    )
    session.change(document, "Step")
    qtbot.waitUntil(settled(window))
    return session.history.state()


def killed(window: Window) -> None:
    """Let go of the journal as a kill of the program does: its bytes are there, its lock is not."""
    scribe = window.safety.autosave._scribe
    assert scribe.flush()
    journal, scribe._journal = scribe._journal, None
    scribe._pusher.soon(journal, journal.abandon)
    assert scribe.flush()
