"""Where the level of a new region begins: at the base, unless that is far from the form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.session import Session
from app.start_level import FAR, NEAR, StartLevel
from app.window import Window
from engine import Document, Mesh
from engine.level import off_form
from tests.app.designing import modes, option, region
from tests.app.driving import Mouse, picture, settled

pytestmark = pytest.mark.window


@pytest.fixture(scope="module")
def hourglass(sphere: Mesh) -> Mesh:
    """Two bells with a waist between them."""
    x, y, z = sphere.vertices.T
    waist = 0.3 + 0.9 * np.abs(z) / 50
    return sphere.with_vertices(np.column_stack([waist * x, waist * y, 1.5 * z]))


def choose_the_end(window: Window, qtbot) -> None:
    """Take the whole upper end of the form as the region."""
    window.actions_table.trigger("view.front")
    qtbot.waitUntil(lambda: not window.viewport.moving)
    qtbot.mouseClick(option(window, "through"), Qt.MouseButton.LeftButton)
    region(window, qtbot, 0.0, -0.29, 0.28)


def off(window: Window) -> float:
    known = window.session.decomposition
    count = known.mode_count(window.session.document.draft.level)
    return off_form(known.surface(count), known.original, known.areas)


def test_a_patch_begins_at_its_base(window: Window, qtbot) -> None:
    region(window, qtbot)
    modes(window, qtbot)
    assert window.session.document.draft.level == 0.0
    assert off(window) < FAR


def test_an_end_begins_where_its_form_is_found_again(
    make_window, hourglass: Mesh, qtbot, artefacts: Path
) -> None:
    window = make_window(hourglass, "light")
    session = window.session
    choose_the_end(window, qtbot)
    qtbot.waitUntil(lambda: session.document.draft.level > 0)
    qtbot.waitUntil(settled(window))
    picture(window, artefacts, "begins above its base")
    known = session.decomposition
    assert off_form(known.base, known.original, known.areas) > FAR
    assert off(window) < NEAR
    assert session.document.draft.level < 0.3, "no finer than it must be"
    assert "the level begins above it" in window.hint.text
    # It is one moment with the choice, and a click shows the base after all.
    assert len(session.history.moments) == 2
    place = window.hint.place_of("level.base")
    for kind in ("press", "release"):
        Mouse().send(window.viewport, kind, np.array([place.x(), place.y()]), NO_KEYS)
    assert session.document.draft.level == 0.0
    qtbot.wait(300)
    assert session.document.draft.level == 0.0, "what the person chose stays"


@pytest.mark.parametrize("drawing", [False, True])
def test_nothing_moves_below_a_hand_that_draws(hourglass: Mesh, qtbot, drawing: bool) -> None:
    session = Session()
    StartLevel(session, lambda: drawing, session)
    session.start(Document.open(hourglass))
    end = np.flatnonzero(hourglass.vertices[:, 2] > 0.0)
    session.choose_region(end, "Region")
    known = lambda: session.decomposition  # noqa: E731
    qtbot.waitUntil(lambda: known() is not None and known().k > 64)
    assert (session.document.draft.level == 0.0) == drawing
    session.close()


NO_KEYS = Qt.KeyboardModifier.NoModifier
