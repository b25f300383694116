"""The region is grown and shrunk by Shift and the wheel; notices end with what they are about."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent

from app.window import Window
from engine.selection import grown
from tests.app.designing import curve, region, rest
from tests.app.driving import Mouse, bow, circle, press

pytestmark = pytest.mark.window
SHIFT = Qt.KeyboardModifier.ShiftModifier


def wheel(window: Window, notches: float, sideways: bool = False) -> None:
    """Turn the wheel over the form with Shift held; some platforms turn it sideways then."""
    view = window.viewport
    at, turn = QPointF(view.rect().center()), round(120 * notches)
    angle = QPoint(turn, 0) if sideways else QPoint(0, turn)
    phase = Qt.ScrollPhase.NoScrollPhase
    none = Qt.MouseButton.NoButton
    place = QPointF(view.mapToGlobal(at))
    event = QWheelEvent(at, place, QPoint(), angle, none, SHIFT, phase, False)
    QCoreApplication.sendEvent(view, event)


@pytest.mark.parametrize("sideways", [False, True])
def test_notches_grow_the_region_and_are_one_change(window: Window, qtbot, sideways: bool) -> None:
    session, view = window.session, window.viewport
    before = region(window, qtbot)
    moments, eye = len(session.history.moments), view.eye
    for _ in range(3):
        wheel(window, 1, sideways)
        assert len(view.scene._region) > len(before), "seen at once"
    assert np.array_equal(session.document.draft.roi, before), "taken when the wheel rests"
    qtbot.waitUntil(lambda: len(session.document.draft.roi) > len(before))
    rest(window, qtbot)
    assert np.array_equal(
        session.document.draft.roi, grown(session.document.mesh.topology, before, 3)
    )
    assert len(session.history.moments) == moments + 1
    assert view.eye.same_as(eye), "and the view stays"
    press(view, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert np.array_equal(session.document.draft.roi, before)


def test_back_and_forth_is_exact_and_something_is_always_left(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    before = region(window, qtbot)
    for notch in (1, 1, -1, -1, -1, 1):
        wheel(window, notch)
    assert np.array_equal(view.scene._region, before)
    for _ in range(60):
        wheel(window, -1)
    qtbot.waitUntil(lambda: 0 < len(session.document.draft.roi) < len(before))


def test_curves_stay_that_still_lie_on_it(window: Window, qtbot) -> None:
    session = window.session
    before = region(window, qtbot)
    curve(window, qtbot, 0.1)
    wheel(window, 1)
    qtbot.waitUntil(lambda: len(session.document.draft.roi) > len(before))
    rest(window, qtbot)
    assert len(session.document.draft.strokes) == 1
    assert session.target_error is not None
    for _ in range(12):
        wheel(window, -1)
    qtbot.waitUntil(lambda: len(session.document.draft.roi) < len(before))
    assert not session.document.draft.strokes, "a curve that is cut off would mean another"


def test_what_is_drawn_next_is_drawn_on_what_is_seen(window: Window, qtbot) -> None:
    session = window.session
    before = region(window, qtbot)
    wheel(window, 2)
    Mouse().stroke(window, bow(window.viewport, (-0.1, 0), (0.1, 0)))
    assert len(session.document.draft.roi) > len(before)
    assert session.document.draft.source is not None


def test_without_a_region_the_wheel_does_nothing(window: Window, qtbot) -> None:
    eye, moments = window.viewport.eye, len(window.session.history.moments)
    wheel(window, 3)
    rest(window, qtbot)
    assert window.viewport.eye.same_as(eye)
    assert len(window.session.history.moments) == moments
    assert window.session.document.draft.roi is None


def test_the_hint_tells_of_it(window: Window, qtbot) -> None:
    region(window, qtbot)
    assert "Shift and the wheel grow or shrink it" in window.hint.hint


@pytest.mark.parametrize("key", [Qt.Key.Key_P, Qt.Key.Key_Escape, Qt.Key.Key_Z])
def test_a_notice_goes_with_what_it_is_about(window: Window, qtbot, key: Qt.Key) -> None:
    view = window.viewport
    Mouse().stroke(window, circle(view, 0.2, 0.0, 0.35))
    rest(window, qtbot)
    assert "outline" in window.hint.notice
    ctrl = Qt.KeyboardModifier.ControlModifier
    press(view, key, ctrl if key == Qt.Key.Key_Z else Qt.KeyboardModifier.NoModifier)
    assert window.hint.notice == ""
