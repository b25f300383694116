"""The same edit, by hand in the window, on meshes that nobody here made; and their replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from engine import Recipe, load, replay
from plugins.registry import kinds
from tests.app.driving import Mouse, bow, circle, picture, settled

PLACES = {
    "spot.obj": (0.05, 0.02),
    "goblet_vase.stl": (0.0, -0.12),
    "mountain_open.obj": (0.0, 0.0),
    "bunny_hr.obj": (0.0, 0.05),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_real_mesh_is_edited_and_replays_to_the_same_bits(
    make_window, qtbot, shared_meshes: Path, tmp_path: Path, artefacts: Path, name: str
) -> None:
    path = shared_meshes / "clean" / name
    window = make_window()
    session, view, hand = window.session, window.viewport, Mouse()
    window.files.open(path)
    qtbot.waitUntil(lambda: session.document is not None)
    first = session.document.mesh
    x, y = PLACES[name]
    hand.stroke(window, circle(view, x, y, 0.11))
    qtbot.waitUntil(settled(window))
    roi = session.document.draft.roi
    assert roi is not None, session.problems.sentence
    hand.stroke(window, bow(view, (x - 0.06, y), (x + 0.06, y)))
    assert session.document.draft.source is not None, session.problems.sentence
    hand.stroke(window, bow(view, (x - 0.06, y), (x + 0.06, y), -0.35))
    qtbot.waitUntil(settled(window))
    assert session.target_error < 0.5
    picture(window, artefacts, f"{path.stem} target")
    qtbot.keyClick(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    qtbot.waitUntil(settled(window))
    picture(window, artefacts, f"{path.stem} applied")
    after = session.document.mesh
    assert after.faces is first.faces
    outside = np.setdiff1d(np.arange(first.n), roi)
    assert (after.vertices[outside] == first.vertices[outside]).all()
    assert (after.vertices[roi] != first.vertices[roi]).any()
    again = replay(Recipe.from_json(session.document.recipe.to_json(), kinds()), load(path))
    assert (again.vertices == after.vertices).all()
