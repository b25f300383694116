"""Brush, handle and symmetrise with real events in a window; equal to their replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from engine import Recipe, replay
from plugins.registry import kinds
from tests.app.driving import Mouse, Pen, bow, circle, picture, settled

pytestmark = pytest.mark.window

NO_KEYS = Qt.KeyboardModifier.NoModifier


def test_paint_a_region_take_a_handle_and_make_it_symmetric(window, qtbot, artefacts: Path) -> None:
    session, host, view = window.session, window.toolhost, window.viewport
    first = session.document.mesh

    # Paint with the mouse, rub out with the pen's eraser end, pin a point.
    qtbot.keyClick(view, Qt.Key.Key_P)
    assert host.active.id == "brush"
    host.toolbox.set_options("brush", type(host.toolbox.options_of("brush"))(radius=60.0))
    Mouse().stroke(window, bow(view, (0.05, 0.1), (0.3, -0.1), 0.3), release=False)
    picture(window, artefacts, "1 painting")
    Mouse().send(view, "release", bow(view, (0.05, 0.1), (0.3, -0.1), 0.3)[-1], NO_KEYS)
    painted = session.document.draft.roi
    assert len(painted) > 200
    assert host.active.id == "brush", "it stays in hand"
    qtbot.waitUntil(settled(window))
    Pen(eraser=True).stroke(window, bow(view, (0.32, -0.2), (0.36, 0.1)))
    rubbed = session.document.draft.roi
    assert set(rubbed) < set(painted)
    qtbot.waitUntil(settled(window))

    # Take a handle and drag it to the right: the form follows while the hand moves.
    qtbot.keyClick(view, Qt.Key.Key_L)
    Mouse().stroke(window, circle(view, 0.15, 0.0, 0.26))
    qtbot.waitUntil(settled(window))
    qtbot.keyClick(view, Qt.Key.Key_H)
    assert host.active.id == "handle"
    way = bow(view, (0.15, 0.0), (0.32, -0.12))
    Mouse().stroke(window, way, release=False)
    qtbot.waitUntil(lambda: session.shown is not None and moved(session.shown, first) > 2.0)
    qtbot.waitUntil(lambda: not session.jobs.busy("solve"))
    picture(window, artefacts, "2 handle held")
    Mouse().send(view, "release", way[-1], NO_KEYS)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    qtbot.waitUntil(settled(window))
    (handle,) = session.document.recipe.steps
    assert handle.kind == "handle"
    picture(window, artefacts, "3 handle let go")

    # The other side becomes the same.
    session.choose_region(None, "Region left")
    host.choose("symmetrise")
    options = type(host.toolbox.options_of("symmetrise"))(keep="right", plane="middle")
    host.toolbox.set_options("symmetrise", options)
    qtbot.waitUntil(lambda: moved(session.shown, session.document.mesh) > 2.0)
    host.enter()
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 2)
    qtbot.waitUntil(settled(window))
    picture(window, artefacts, "4 symmetric")

    recipe = Recipe.from_json(session.document.recipe.to_json(), kinds())
    assert (replay(recipe, first).vertices == session.document.mesh.vertices).all()
    assert session.problems.sentence == ""


def moved(mesh, other) -> float:
    """Largest way of a vertex in mm."""
    return float(np.linalg.norm(mesh.vertices - other.vertices, axis=1).max())
