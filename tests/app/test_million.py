"""A million vertices in the window, by hand: turned, lassoed, edited, undone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from engine import Document
from tests.app.designing import CTRL, draw, rest, turned
from tests.app.driving import Mouse, bow, circle, picture, settled
from tests.app.viewport_stage import sphere

MINUTES = 30


@pytest.mark.window
@pytest.mark.soak
@pytest.mark.timeout(60 * MINUTES)
def test_a_million_vertices_are_turned_lassoed_and_edited(
    make_window, qtbot, artefacts: Path
) -> None:
    window = make_window(size=(1100, 760))
    session, view = window.session, window.viewport
    mesh = sphere(1_000_000, 50.0)
    session.start(Document.open(mesh, "million.ply"))
    ready = lambda: settled(window)() and not view.moving and not view.sight_comes  # noqa: E731
    qtbot.waitUntil(ready, timeout=60 * MINUTES)
    azimuth = view.eye.azimuth
    turned(window, qtbot, 60)
    assert view.eye.azimuth != azimuth
    qtbot.waitUntil(ready, timeout=60 * MINUTES)

    Mouse().stroke(window, circle(view, 0.0, 0.0, 0.11))
    qtbot.waitUntil(lambda: session.document.draft.roi is not None, timeout=60 * MINUTES)
    qtbot.waitUntil(ready, timeout=60 * MINUTES)
    roi = session.document.draft.roi
    assert 10_000 < len(roi) < 60_000
    ends = (-0.05, 0.0), (0.05, 0.0)
    draw(window, qtbot, bow(view, *ends))
    assert session.document.draft.source is not None, session.problems.sentence
    draw(window, qtbot, bow(view, *ends, -0.3))
    qtbot.waitUntil(ready, timeout=60 * MINUTES)
    assert session.target_error < 2.0
    picture(window, artefacts, "a target on a million vertices")
    qtbot.keyClick(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1, timeout=60 * MINUTES)
    rest(window, qtbot)
    way = np.linalg.norm(session.document.mesh.vertices - mesh.vertices, axis=1)
    assert way.max() > 1.0
    assert np.isin(np.flatnonzero(way > 0), roi).all(), "only the region moves"
    while session.document.draft.roi is not None:  # to where nothing had been chosen yet
        qtbot.keyClick(view, Qt.Key.Key_Z, CTRL)
    rest(window, qtbot)
    assert (session.shown.vertices == mesh.vertices).all()
