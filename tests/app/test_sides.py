"""Sides of the form are what the view cube calls them, whichever axis is upright."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from app.window import Window
from engine import Mesh
from tests.app.driving import picture, settled

pytestmark = pytest.mark.window

SIDES = ("right", "left", "front", "back", "top", "bottom")


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("side", SIDES)
def test_what_is_nearest_from_a_side_lies_on_that_side(
    window: Window, qtbot, side: str, up: str
) -> None:
    view = window.viewport
    window.set_up_axis(up)
    view.standard_view(side, animate=False)
    mesh = window.session.document.mesh
    nearest = mesh.vertices[view.view().depth(mesh.vertices).argmin()]
    away = nearest - mesh.bounds.mean(axis=0)
    assert view.towards(side) @ away > 0.9 * np.linalg.norm(away)


def test_the_side_to_keep_stays_and_the_other_becomes_its_image(
    make_window, sphere: Mesh, qtbot, artefacts: Path
) -> None:
    dent = np.linalg.norm(sphere.vertices - (50, 0, 0), axis=1) < 20
    dented = sphere.with_vertices(np.where(dent[:, None], 0.9, 1.0) * sphere.vertices)
    window = make_window(dented, "light")
    session = window.session
    window.toolhost.choose("symmetrise")
    QCoreApplication.processEvents()
    choose(window, "plane", Qt.Key.Key_Down)
    for _ in range(2):
        choose(window, "keep", Qt.Key.Key_Down)  # after "Edited" and "Right" comes "Left"
    assert window.toolhost.context.options.keep == "left"
    qtbot.waitUntil(lambda: settled(window)() and session.shown.vertices is not dented.vertices)
    picture(window, artefacts, "the left is kept")
    shown = session.shown.vertices
    left = dented.vertices[:, 0] < dented.bounds.mean(axis=0)[0] - 1
    assert (shown[left] == dented.vertices[left]).all(), "what is kept does not move"
    radius = np.linalg.norm(shown - dented.bounds.mean(axis=0), axis=1)
    assert radius[dent].min() > 45, "the dent on the right is gone"


def choose(window: Window, name: str, key: Qt.Key) -> None:
    """Press a key on the choice of an option of the tool in hand."""
    found = window.strip.findChildren(QWidget, f"option {name}")
    box = next(one for one in found if one.isVisible())
    box.setFocus()
    QTest.keyClick(box, key)
