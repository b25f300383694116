"""Tools that are set by their options, and the rail they are on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QKeySequence

from app.window import Window
from engine import Recipe, replay
from plugins.registry import kinds
from tests.app.designing import enter, option, region, rest, typed
from tests.app.driving import LEFT, picture

pytestmark = pytest.mark.window


@pytest.mark.parametrize(
    ("tool", "field", "value"),
    [
        ("smooth", "amount", "1"),
        ("equaliser", "small", "3"),
        ("inflate", "distance", "6"),
        ("remesh", "density", "0.5"),
    ],
)
def test_a_tool_is_set_seen_and_kept(
    window: Window, qtbot, artefacts: Path, tool: str, field: str, value: str
) -> None:
    session = window.session
    roi = region(window, qtbot)
    before = session.document.mesh
    qtbot.mouseClick(window.rail.buttons[tool], LEFT)
    assert window.toolhost.active.id == tool
    typed(qtbot, option(window, field), value)
    rest(window, qtbot)
    if tool != "remesh":
        qtbot.waitUntil(lambda: (session.shown.vertices[roi] != before.vertices[roi]).any())
        assert session.document.mesh is before, "a preview changes nothing"
    picture(window, artefacts, f"tool {tool}")
    enter(window, qtbot)
    after = session.document.mesh
    (step,) = session.document.recipe.steps
    assert step.kind == tool
    if tool == "inflate":
        way = np.linalg.norm(after.vertices - before.vertices, axis=1).max()
        assert way == pytest.approx(6, rel=0.05)
    elif tool == "remesh":
        assert after.n < before.n
    recipe = Recipe.from_json(session.document.recipe.to_json(), kinds())
    again = replay(recipe, session.document.original)
    assert (again.vertices == after.vertices).all()


def test_the_rail_says_the_keys_that_work(window: Window) -> None:
    actions, rail = window.actions_table, window.rail
    assert "(L)" in rail.buttons["lasso"].toolTip()
    actions.remap("tool.lasso", ("Ctrl+Alt+L",))
    assert f"({QKeySequence('Ctrl+Alt+L').toString()})" in rail.buttons["lasso"].toolTip()
    actions.remap("tool.lasso", ())
    assert "(" not in rail.buttons["lasso"].toolTip().partition("<br>")[0]
    actions.remap("tool.lasso", None)
