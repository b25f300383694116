"""The whole edit by keys alone: a cross over the form that arrows move and Space sets to it."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication

from app.window import Window
from tests.app.designing import rest
from tests.app.driving import NONE, Mouse, pixels, press

pytestmark = pytest.mark.window
SHIFT, CTRL, ALT = (
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.AltModifier,
)
WAYS = {"l": Qt.Key.Key_Left, "r": Qt.Key.Key_Right, "u": Qt.Key.Key_Up, "d": Qt.Key.Key_Down}


def go(window: Window, way: str, modifiers: Qt.KeyboardModifier = NONE) -> None:
    """Press arrow keys: "8r 2u" is eight times right, then twice up."""
    for part in way.split():
        for _ in range(int(part[:-1])):
            press(window.viewport, WAYS[part[-1]], modifiers)


def points(window: Window, *ways: str) -> None:
    """Set a point by Space where the cross is, and after each of the ways."""
    press(window.viewport, Qt.Key.Key_Space)
    for way in ways:
        go(window, way)
        press(window.viewport, Qt.Key.Key_Space)


def region(window: Window, qtbot) -> None:
    """Circle the middle of the form by four points."""
    press(window.viewport, Qt.Key.Key_K)
    go(window, "9u")
    points(window, "9r 9d", "9l 9d", "9l 9u")
    press(window.viewport, Qt.Key.Key_Return)
    rest(window, qtbot)


def test_an_edit_without_mouse_or_pen(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    before = session.document.mesh.vertices
    region(window, qtbot)
    roi = session.document.draft.roi
    assert roi is not None
    seen = view.view().project(before[roi]) - (view.width() / 2, view.height() / 2)
    assert np.abs(seen).max() < 9 * 12 * 1.2, "what the curve went around, and nothing else"
    assert len(roi) > 50
    assert window.toolhost.active.id == "source", "the flow goes on"
    go(window, "3r 9d")  # from where the lasso ended, at the left
    go(window, "9u")
    points(window, "6r", "6r")
    press(view, Qt.Key.Key_Return)
    assert session.document.draft.source is not None, session.problems.sentence
    assert window.toolhost.active.id == "target"
    go(window, "12l")
    points(window, "6r 3u", "6r 3d")
    press(view, Qt.Key.Key_Return)
    rest(window, qtbot)
    assert len(session.document.draft.strokes) == 1
    assert session.target_error is not None
    assert session.target_error < 1.0
    press(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    rest(window, qtbot)
    assert not np.allclose(session.document.mesh.vertices, before)


def test_a_target_is_dragged_by_arrows_and_the_form_follows(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    go(window, "3r")
    points(window, "6r", "6r")
    press(view, Qt.Key.Key_Return)
    go(window, "12l")
    points(window, "6r 1u", "6r 1d")
    press(view, Qt.Key.Key_Return)
    rest(window, qtbot)
    target = session.document.draft.strokes[0].target
    go(window, "6l 1u")
    press(view, Qt.Key.Key_Space)
    shown = view.vertices.copy()
    go(window, "3u")
    qtbot.waitUntil(lambda: not np.allclose(view.vertices, shown))
    press(view, Qt.Key.Key_Space)
    rest(window, qtbot)
    moved = session.document.draft.strokes[0].target - target
    assert moved[:, 1].min() == pytest.approx(-36, abs=2), "up by three steps of 12 px"


def test_the_handle_follows_the_arrows(window: Window, qtbot) -> None:
    region(window, qtbot)
    view, session = window.viewport, window.session
    press(view, Qt.Key.Key_H)
    go(window, "9r")
    press(view, Qt.Key.Key_Space)
    go(window, "2u 2r")
    press(view, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    step = session.document.recipe.steps[0]
    assert step.kind == "handle"
    drag = view.view().project(session.document.mesh.vertices[step.patch])
    was = view.view().project(session.document.original.vertices[step.patch])
    # A drag is parallel to the picture: near to the middle of a patch it is what the arrows went.
    assert np.median(drag - was, axis=0) == pytest.approx((24, -24), abs=3)


def test_the_brush_paints_under_the_cross_and_ctrl_takes_away(window: Window, qtbot) -> None:
    view, session = window.viewport, window.session
    press(view, Qt.Key.Key_K)
    press(view, Qt.Key.Key_P)
    press(view, Qt.Key.Key_Space)
    go(window, "4r")
    press(view, Qt.Key.Key_Space)
    rest(window, qtbot)
    painted = len(session.document.draft.roi)
    press(view, Qt.Key.Key_Space, CTRL)
    press(view, Qt.Key.Key_Space)
    rest(window, qtbot)
    assert 0 < len(session.document.draft.roi) < painted


def test_the_view_turns_and_zooms_beside_it(window: Window, qtbot) -> None:
    view, hand = window.viewport, window.key_hand
    eye = view.eye
    press(view, Qt.Key.Key_K)
    at = hand.at
    go(window, "3r")
    assert view.eye.same_as(eye)
    assert hand.at == (at[0] + 36, at[1])
    go(window, "1r", SHIFT)
    assert hand.at == (at[0] + 38, at[1]), "with Shift finely"
    go(window, "1r", ALT)
    assert not view.eye.same_as(eye), "with Alt they turn the view as else"
    assert hand.at == (at[0] + 38, at[1])
    eye = view.eye
    go(window, "1u", CTRL)
    assert view.eye.distance < eye.distance
    press(view, Qt.Key.Key_K)
    eye = view.eye
    go(window, "1r")
    assert not view.eye.same_as(eye), "and without the cross they turn it again"


def test_two_arrows_at_once_go_aslant_and_the_cross_stays_in_the_picture(
    window: Window, qtbot
) -> None:
    view, hand = window.viewport, window.key_hand
    press(view, Qt.Key.Key_K)
    x, y = hand.at

    def send(kind: QEvent.Type, key: Qt.Key, again: bool = False) -> None:
        QApplication.sendEvent(view, QKeyEvent(kind, key, NONE, "", again))

    send(QEvent.Type.KeyPress, Qt.Key.Key_Right)
    send(QEvent.Type.KeyPress, Qt.Key.Key_Up)
    send(QEvent.Type.KeyPress, Qt.Key.Key_Up, again=True)
    assert hand.at == (x + 36, y - 24)
    send(QEvent.Type.KeyRelease, Qt.Key.Key_Right)
    send(QEvent.Type.KeyRelease, Qt.Key.Key_Up)
    go(window, "90r 90d")
    assert 0 < hand.at[0] < view.width()
    assert 0 < hand.at[1] < view.height()


def test_the_hint_can_be_clicked_to_end_a_curve(window: Window, qtbot) -> None:
    view = window.viewport
    press(view, Qt.Key.Key_K)
    points(window, "6r 6d", "6l 6d")
    go(window, "6l 6u")
    rest(window, qtbot)
    place = window.hint.place_of("edit.apply")
    assert place is not None
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=place.toPoint())
    rest(window, qtbot)
    assert window.session.document.draft.roi is not None
    assert window.key_hand.on, "a click on words is no stroke"


def test_escape_drops_a_curve_and_the_mouse_takes_over(window: Window, qtbot) -> None:
    view, hand = window.viewport, window.key_hand
    press(view, Qt.Key.Key_K)
    points(window, "3r", "3d")
    assert hand.down
    assert "next point" in window.hint.text
    press(view, Qt.Key.Key_Escape)
    assert not hand.down
    assert hand.on
    assert not window.toolhost.in_gesture
    points(window, "3r")
    Mouse().send(view, "press", (300, 300), NONE)
    assert not hand.on, "whoever takes the mouse needs the cross no more"
    Mouse().send(view, "move", (310, 300), NONE)
    Mouse().send(view, "release", (310, 300), NONE)
    assert not window.toolhost.in_gesture
    assert window.session.document.draft.roi is None


def test_the_cross_is_seen_and_the_hint_says_what_the_keys_do(window: Window, qtbot) -> None:
    view = window.viewport
    before = pixels(view)
    press(view, Qt.Key.Key_K)
    rest(window, qtbot)
    after = pixels(view)
    x, y = (int(v * view.devicePixelRatioF()) for v in window.key_hand.at)
    changed = (before != after).any(axis=2)
    assert changed[y - 14 : y + 15, x - 14 : x + 15].sum() > 40
    assert "Arrow keys move the cross, Space sets the first point" in window.hint.text
    press(view, Qt.Key.Key_P)
    qtbot.waitUntil(lambda: "Space presses" in window.hint.text)
    press(view, Qt.Key.Key_K)
    qtbot.waitUntil(lambda: "Space" not in window.hint.text)


def test_all_that_is_in_view_becomes_the_region(window: Window, qtbot) -> None:
    view = window.viewport
    view.setFocus()
    for _ in range(12):
        press(view, Qt.Key.Key_Up, CTRL)
    rest(window, qtbot)
    window.actions_table.trigger("region.view")
    rest(window, qtbot)
    roi = window.session.document.draft.roi
    seen = view.view().project(window.session.document.mesh.vertices[roi])
    assert len(roi) > 20
    assert (seen >= 0).all()
    assert (seen <= (view.width(), view.height())).all()
