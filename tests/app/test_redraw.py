"""A target is drawn again, whole or in part, with mouse and pen in a rendered window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.window import Window
from engine.arrays import F64
from tests.app.designing import draw, enter, region
from tests.app.driving import Mouse, Pen, bow, picture

pytestmark = pytest.mark.window

LEFT, RIGHT = (-0.12, 0.0), (0.12, 0.0)


def sketched(window: Window, qtbot) -> None:
    """Draw a source and a target above it."""
    region(window, qtbot, radius=0.3)
    draw(window, qtbot, bow(window.viewport, LEFT, RIGHT), bow(window.viewport, LEFT, RIGHT, 0.15))


def target(window: Window) -> F64:
    """The target of the only curve, (c, 2) px, from left to right."""
    (stroke,) = window.session.document.draft.strokes
    return stroke.target[np.argsort(stroke.target[:, 0])]


@pytest.mark.parametrize("hand", [Mouse(), Pen()], ids=["mouse", "pen"])
def test_a_part_is_drawn_again(window: Window, qtbot, artefacts: Path, hand: Mouse) -> None:
    sketched(window, qtbot)
    before = target(window)
    shown = window.session.shown
    count = len(before)
    a, b = before[count // 3], before[4 * count // 5]
    t = np.linspace(0, 1, 60)[:, None]
    dent = a + t * (b - a) + np.sin(np.pi * t) ** 2 * [0.0, 0.04 * window.viewport.height()]
    draw(window, qtbot, dent, hand=hand)
    after = target(window)
    moved = np.linalg.norm(after - before, axis=1)
    assert moved[: count // 3].max() < 1.0, "what was not drawn again stays"
    assert moved[9 * count // 10 :].max() < 3.0
    assert moved.max() > 0.02 * window.viewport.height()
    assert window.session.shown is not shown, "the surface followed"
    assert window.session.target_error < 1.5
    picture(window, artefacts, f"a part drawn again with the {hand.name}")
    window.session.undo()
    assert target(window) == pytest.approx(before, abs=1e-12)


def test_a_whole_curve_is_drawn_again_where_the_last_one_began(
    window: Window, qtbot, artefacts: Path
) -> None:
    sketched(window, qtbot)
    before = target(window)
    # As a hand does it: from the first point of the curve that is there, over to its last.
    draw(window, qtbot, bow(window.viewport, LEFT, RIGHT, -0.15))
    after = target(window)
    middle = len(before) // 2
    height = window.viewport.height()
    assert np.abs(after[[0, -1]] - before[[0, -1]]).max() < 0.02 * height
    assert abs(after[middle, 1] - before[middle, 1]) > 0.05 * height
    assert window.session.target_error < 1.0
    picture(window, artefacts, "drawn again from its end")
    enter(window, qtbot)
    assert len(window.session.document.recipe.steps) == 1
