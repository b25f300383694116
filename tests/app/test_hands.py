"""Pen, touchpad and touch screen on the viewport in a rendered window, by the events Qt sends."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QNativeGestureEvent, QTabletEvent
from PySide6.QtTest import QTest

from tests.app.viewport_stage import (
    CTRL,
    LEFT,
    MIDDLE,
    NONE,
    PLAIN,
    RIGHT,
    SHIFT,
    Stage,
    eraser_device,
    pen_device,
    torus,
    touchpad,
)

pytestmark = pytest.mark.window

PRESS, MOVE, RELEASE = (
    QEvent.Type.TabletPress,
    QEvent.Type.TabletMove,
    QEvent.Type.TabletRelease,
)
GESTURE = Qt.NativeGestureType
HOURS = count(3_600_000, 3_600_000)  # ms: no test draws within the time of another


@pytest.fixture(scope="module")
def shared_stage(qapp):
    made = Stage(torus(6000))
    yield made
    made.close()


@pytest.fixture
def stage(shared_stage, qtbot):
    shared_stage.reset(torus(6000))
    return shared_stage


def on_form(stage) -> np.ndarray:
    return stage.middle * (1.0, 1.25)


def tablet(stage, kind, at, *, when=0, tilt=(0.0, 0.0), turn=0.0, pressure=0.5, device=None):
    """Send one event of the pen's tip, as a driver that knows tilt and rotation does."""
    place = QPointF(*map(float, at))
    event = QTabletEvent(
        kind,
        device or pen_device(),
        place,
        QPointF(stage.viewport.mapToGlobal(place)),
        pressure,
        *tilt,
        0.0,
        turn,
        0.0,
        PLAIN,
        NONE if kind == MOVE else LEFT,
        NONE if kind == RELEASE or pressure == 0 else LEFT,
    )
    event.setTimestamp(when)
    QCoreApplication.sendEvent(stage.viewport, event)
    return event


def tap(stage, at, when, **more) -> None:
    tablet(stage, PRESS, at, when=when, **more)
    tablet(stage, RELEASE, at, when=when + 40, **more)


def native(stage, kind, at, value=0.0, delta=(0.0, 0.0), fingers=2) -> QNativeGestureEvent:
    """Send one event of a touchpad's own gestures."""
    place = QPointF(*map(float, at))
    far = QPointF(stage.viewport.mapToGlobal(place))
    event = QNativeGestureEvent(
        kind, touchpad(), fingers, place, place, far, value, QPointF(*delta)
    )
    QCoreApplication.sendEvent(stage.viewport, event)
    return event


# The touchpad's own gestures


def test_pinching_zooms_to_the_fingers(stage):
    viewport = stage.viewport
    at = on_form(stage)
    point = viewport.pick(*at).point
    before = viewport.eye
    native(stage, GESTURE.BeginNativeGesture, at)
    for _ in range(5):
        event = native(stage, GESTURE.ZoomNativeGesture, at, value=0.06)
        assert event.isAccepted()
    native(stage, GESTURE.EndNativeGesture, at)
    assert viewport.eye.distance == pytest.approx(before.distance / 1.06**5)
    assert viewport.eye.azimuth == before.azimuth
    assert np.abs(viewport.view().project(point)[0] - at).max() < 1.0
    for _ in range(5):
        native(stage, GESTURE.ZoomNativeGesture, at, value=1 / 1.06 - 1)
    assert viewport.eye.distance == pytest.approx(before.distance)
    assert stage.events == []


def test_an_absurd_pinch_does_not_turn_the_picture_inside_out(stage):
    viewport = stage.viewport
    for value in (-3.0, -1.0):
        before = viewport.eye.distance
        native(stage, GESTURE.ZoomNativeGesture, stage.middle, value=value)
        assert before < viewport.eye.distance <= 5.001 * before


def test_turning_two_fingers_turns_the_form_with_them(stage):
    viewport = stage.viewport
    before = viewport.eye
    native(stage, GESTURE.RotateNativeGesture, stage.middle, value=30.0)
    turned = viewport.eye
    assert turned.azimuth == pytest.approx(before.azimuth - np.radians(30), abs=0.01)
    assert (turned.elevation, turned.distance) == (before.elevation, before.distance)
    native(stage, GESTURE.RotateNativeGesture, stage.middle, value=-30.0)
    assert viewport.eye.azimuth == pytest.approx(before.azimuth)


def test_a_native_pan_moves_the_form_with_the_fingers(stage):
    viewport = stage.viewport
    at = on_form(stage)
    point = viewport.pick(*at).point
    native(stage, GESTURE.PanNativeGesture, at, delta=(24.0, -10.0))
    assert np.abs(viewport.view().project(point)[0] - (at + np.array([24, -10]))).max() < 1.0


def test_a_swipe_is_not_ours(stage):
    before = stage.viewport.eye
    native(stage, GESTURE.SwipeNativeGesture, stage.middle, value=90.0, fingers=3)
    native(stage, GESTURE.SmartZoomNativeGesture, stage.middle)
    assert stage.viewport.eye is before


def test_two_fingers_scroll_by_pixels_and_a_mouse_wheel_with_pixels_still_zooms(stage):
    viewport = stage.viewport
    before = viewport.eye
    stage.wheel(stage.middle, 0.25, pixels=(0, 30), device=touchpad())
    turned = viewport.eye
    assert turned.distance == before.distance
    assert turned.elevation != before.elevation
    assert turned.azimuth == pytest.approx(before.azimuth)
    stage.wheel(stage.middle, 1.0, pixels=(0, 30))  # a mouse with a fine wheel
    assert viewport.eye.distance == pytest.approx(turned.distance / 1.15)
    stage.wheel(stage.middle, 1.0, CTRL, pixels=(0, 30), device=touchpad())
    assert viewport.eye.distance == pytest.approx(turned.distance / 1.15**2)


def test_fractions_of_a_notch_add_up(stage):
    viewport = stage.viewport
    before = viewport.eye.distance
    for _ in range(8):
        stage.wheel(stage.middle, 0.125)
    assert viewport.eye.distance == pytest.approx(before / 1.15)


def test_scrolling_while_a_stroke_is_drawn_does_not_end_it(stage):
    stage.mouse(QEvent.Type.MouseButtonPress, (200, 200), LEFT, LEFT)
    stage.mouse(QEvent.Type.MouseMove, (210, 200), NONE, LEFT)
    native(stage, GESTURE.ZoomNativeGesture, (210, 200), value=0.1)
    stage.mouse(QEvent.Type.MouseMove, (220, 200), NONE, LEFT)
    stage.mouse(QEvent.Type.MouseButtonRelease, (220, 200), LEFT, NONE)
    assert stage.kinds == ["press", "move", "move", "release"]


# The pen


def test_a_double_tap_of_the_pen_is_a_double_click(stage):
    at, now = on_form(stage), next(HOURS)
    tap(stage, at, when=now)
    tap(stage, at + np.array([3, -2]), when=now + 200)
    tap(stage, at, when=now + 400)
    doubles = [e.double for e in stage.events if e.kind == "press"]
    assert doubles == [False, True, False]
    assert all(e.pen for e in stage.events)


@pytest.mark.parametrize(("far", "later"), [((60, 0), 150), ((0, 0), 2000)])
def test_two_taps_apart_in_place_or_time_are_two(stage, far, later):
    at, now = on_form(stage), next(HOURS)
    tap(stage, at, when=now)
    tap(stage, at + far, when=now + later)
    assert not any(e.double for e in stage.events)


def test_the_pen_hovers_with_its_place_and_without_pressure(stage):
    before = stage.viewport.eye
    tablet(stage, MOVE, (60.25, 70.5), pressure=0.0, when=10)
    tablet(stage, MOVE, (61.75, 70.5), pressure=0.0, when=18)
    assert stage.kinds == ["hover", "hover"]
    assert [e.xy for e in stage.events] == [(60.25, 70.5), (61.75, 70.5)]
    assert all(e.pen and e.pressure == 0.0 and not e.eraser for e in stage.events)
    assert stage.viewport.eye is before


def test_tilt_and_rotation_of_the_pen_change_nothing_of_a_stroke(stage):
    path = stage.ellipse()[:8]
    for tilt, turn in (((0.0, 0.0), 0.0), ((55.0, -40.0), 120.0)):
        for kind, at in zip([PRESS, *[MOVE] * 6, RELEASE], path, strict=True):
            tablet(stage, kind, at, tilt=tilt, turn=turn, pressure=0.7)
    upright, tilted = stage.events[:8], stage.events[8:]
    assert stage.kinds[:8] == ["press", *["move"] * 6, "release"]
    assert [(e.kind, e.xy, e.pressure) for e in upright] == [
        (e.kind, e.xy, e.pressure) for e in tilted
    ]


def test_pressure_is_that_of_each_point(stage):
    path = stage.ellipse()[:5]
    given = [0.1, 0.35, 0.8, 1.0]
    tablet(stage, PRESS, path[0], pressure=given[0])
    for at, pressure in zip(path[1:4], given[1:], strict=True):
        tablet(stage, MOVE, at, pressure=pressure)
    tablet(stage, RELEASE, path[4], pressure=0.0)
    assert [e.pressure for e in stage.events] == pytest.approx([*given, 0.0], abs=1e-3)


def test_the_eraser_end_hovers_draws_and_is_forgotten_when_the_pen_is_turned(stage):
    at = on_form(stage)
    tablet(stage, MOVE, at, pressure=0.0, device=eraser_device())
    tap(stage, at, when=100, device=eraser_device())
    tap(stage, at + np.array([80, 0]), when=900)
    assert [(e.kind, e.eraser) for e in stage.events] == [
        ("hover", True),
        ("press", True),
        ("release", True),
        ("press", False),
        ("release", False),
    ]


@pytest.mark.parametrize("button", [RIGHT, MIDDLE])
def test_either_barrel_button_turns_about_the_point_below_the_pen(stage, button):
    viewport = stage.viewport
    start = on_form(stage)
    pivot = viewport.pick(*start).point
    before = viewport.eye
    stage.pen_drag(np.linspace(start, start + np.array([50, 20]), 6), button)
    assert viewport.eye.azimuth != before.azimuth
    assert np.abs(viewport.view().project(pivot)[0] - start).max() < 1.0
    assert stage.events == []


def test_a_barrel_button_pressed_in_a_stroke_does_not_break_it(stage):
    before = stage.viewport.eye
    device = pen_device()
    stage.pen(PRESS, (200, 200), LEFT, LEFT, device=device)
    stage.pen(PRESS, (205, 200), RIGHT, LEFT | RIGHT, device=device)
    stage.pen(MOVE, (215, 205), NONE, LEFT | RIGHT, device=device)
    stage.pen(RELEASE, (215, 205), RIGHT, LEFT, device=device)
    stage.pen(MOVE, (220, 205), NONE, LEFT, device=device)
    stage.pen(RELEASE, (220, 205), LEFT, NONE, device=device)
    assert stage.kinds == ["press", "move", "move", "release"]
    assert stage.viewport.eye is before


def test_the_same_pen_reported_as_a_mouse_as_well_draws_once(stage):
    device = pen_device()
    stage.pen(PRESS, (200, 200), LEFT, LEFT, device=device)
    stage.mouse(QEvent.Type.MouseButtonPress, (200, 200), LEFT, LEFT)
    stage.pen(MOVE, (220, 205), NONE, LEFT, device=device)
    stage.mouse(QEvent.Type.MouseMove, (220, 205), NONE, LEFT)
    stage.pen(RELEASE, (220, 205), LEFT, NONE, device=device)
    assert stage.kinds == ["press", "move", "release"]
    assert all(e.pen for e in stage.events)


def test_a_pen_that_leaves_the_window_loses_its_stroke_only_with_the_window(stage, qtbot):
    tablet(stage, PRESS, (200, 200))
    QCoreApplication.sendEvent(stage.viewport, QEvent(QEvent.Type.TabletLeaveProximity))
    tablet(stage, MOVE, (210, 200))
    assert stage.kinds == ["press", "move"]
    with qtbot.waitSignal(stage.viewport.cancelled):
        stage.viewport.hide()
    stage.viewport.show()
    stage.settle()


# The touch screen


def test_one_finger_draws(stage):
    device = QTest.createTouchDevice()
    view = stage.viewport
    for _ in range(2):
        QTest.touchEvent(view, device).press(0, QPoint(200, 200)).commit()
        QTest.touchEvent(view, device).release(0, QPoint(200, 200)).commit()
    assert stage.kinds == ["press", "release"] * 2
    assert not any(e.pen for e in stage.events)


def test_two_fingers_pinch_and_turn_at_once_and_draw_nothing_after(stage):
    view, device = stage.viewport, QTest.createTouchDevice()
    before = view.eye
    first = QTest.touchEvent(view, device)
    first.press(0, QPoint(200, 200)).press(1, QPoint(300, 200)).commit()
    moved = QTest.touchEvent(view, device)
    moved.move(0, QPoint(200, 240)).move(1, QPoint(350, 240)).commit()
    assert view.hands.navigating
    assert view.eye.distance == pytest.approx(before.distance / 1.5, rel=0.02)
    assert view.eye.elevation != before.elevation
    QTest.touchEvent(view, device).stationary(0).release(1, QPoint(350, 240)).commit()
    QTest.touchEvent(view, device).move(0, QPoint(220, 260)).commit()
    QTest.touchEvent(view, device).release(0, QPoint(220, 260)).commit()
    assert stage.events == []
    assert not view.hands.navigating


def test_shift_and_ctrl_of_the_keyboard_reach_the_pen(stage):
    stage.pen_drag(stage.ellipse()[:4], modifiers=SHIFT | CTRL)
    assert all(e.shift and e.ctrl for e in stage.events)
