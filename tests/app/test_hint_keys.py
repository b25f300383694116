"""Sentences of the hint line name actions by the keys they have now, and these can be clicked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPointF

from app.key_words import linked, plain
from app.window import Window
from tests.app.designing import draw, region
from tests.app.driving import NONE, Mouse, Pen, bow, picture

READ = {"tool.lasso": "L", "edit.back": "<Esc>"}


def read(name: str) -> str:
    return READ.get(name, "")


def test_a_sentence_names_actions_by_what_a_person_reads() -> None:
    assert plain("Press {tool.lasso} or {edit.back}", read) == "Press L or <Esc>"
    assert plain("{no.action} and {} and {x}.obj", read) == "{no.action} and {} and {x}.obj"


def test_a_link_is_to_an_action_and_nothing_else_is_markup() -> None:
    words = linked("<b>{tool.lasso}</b> {no.action} {edit.back}", read)
    assert words == (
        '&lt;b&gt;<a href="tool.lasso">L</a>&lt;/b&gt; {no.action} '
        '<a href="edit.back">&lt;Esc&gt;</a>'
    )


def click(window: Window, hand: Mouse, action: str) -> None:
    """Click an action that the hint line names."""
    place = window.hint.place_of(action)
    assert place is not None, f"{window.hint.text} does not offer {action}"
    at = np.array([place.x(), place.y()])
    hand.send(window.viewport, "press", at, NONE)
    hand.send(window.viewport, "release", at, NONE)


@pytest.mark.window
@pytest.mark.parametrize("hand", [Mouse(), Pen()], ids=["mouse", "pen"])
def test_what_a_hint_offers_is_done_by_a_click(
    window: Window, qtbot, artefacts: Path, hand: Mouse
) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    draw(window, qtbot, bow(view, (-0.12, 0.0), (0.12, 0.0)))
    draw(window, qtbot, bow(view, (-0.12, 0.05), (0.12, 0.05), 0.2))
    assert (
        window.hint.text
        == "Drag the curve, draw it or a part of it again, S for another, Enter to apply"
    )
    picture(window, artefacts, "hint with keys")
    before = session.history.current_id
    click(window, hand, "tool.source")
    assert window.toolhost.active.id == "source"
    assert session.history.current_id == before, "nothing was drawn below the plate"
    window.toolhost.choose("target")
    click(window, hand, "edit.apply")
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)


@pytest.mark.window
def test_a_hint_follows_a_key_given_to_something_else(window: Window, qtbot) -> None:
    window.toolhost.choose("source")
    assert "press L and" in window.hint.text
    window.actions_table.remap("tool.lasso", ("Ctrl+7",))
    assert "press Ctrl+7 and" in window.hint.text
    assert "Ctrl+7" in window.rail.buttons["lasso"].toolTip()
    window.actions_table.remap("tool.lasso", ())
    assert "press Lasso and" in window.hint.text, "without a key it has its name"
    window.actions_table.remap("level.less", ("Ctrl+8",))
    assert "Ctrl+8 and ]" in window.level.slider.toolTip()
    window.actions_table.remap("edit.apply", ("Ctrl+9",))
    assert "(Ctrl+9)" in window.edit.apply.toolTip()


@pytest.mark.window
def test_beside_its_links_the_hint_lets_the_hand_through(window: Window, qtbot) -> None:
    hint, view = window.hint, window.viewport
    pressed: list[object] = []
    view.pointer.connect(lambda pointer: pressed.append(pointer.kind))
    corner = QPointF(hint.geometry().topLeft()) + QPointF(4, 4)
    Mouse().stroke(window, [np.array([corner.x(), corner.y()])] * 2)
    assert "press" in pressed
