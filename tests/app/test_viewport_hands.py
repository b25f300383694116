"""Mouse, pen, wheel, touch and keys on the viewport: what draws, what moves the camera."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest

from tests.app.viewport_stage import (
    ALT,
    CTRL,
    LEFT,
    MIDDLE,
    NONE,
    RIGHT,
    SHIFT,
    eraser_device,
    pen_device,
    touchpad,
)

pytestmark = pytest.mark.window
SHIFTED = np.array([40, -25])


def test_mouse_lasso_becomes_pointer_events(stage):
    eye = stage.viewport.eye
    path = stage.ellipse() + 0.25
    stage.mouse_drag(path)
    assert stage.kinds == ["press"] + ["move"] * (len(path) - 1) + ["release"]
    got = np.array([e.xy for e in stage.events[:-1]])
    assert np.abs(got - path).max() < 1e-9
    assert not any(e.pen or e.shift or e.ctrl for e in stage.events)
    assert stage.viewport.eye is eye


def test_pen_lasso_keeps_pressure_and_fractions_of_pixels(stage):
    path = stage.ellipse() + 0.37
    stage.pen_drag(path, modifiers=SHIFT)
    assert stage.kinds == ["press"] + ["move"] * (len(path) - 1) + ["release"]
    assert np.abs(np.array([e.xy for e in stage.events[:-1]]) - path).max() < 1e-9
    assert all(e.pen and e.shift and abs(e.pressure - 0.5) < 1e-6 for e in stage.events)
    assert not any(e.eraser for e in stage.events)


def test_eraser_end_is_known(stage):
    stage.pen_drag(stage.ellipse()[:5], device=eraser_device())
    assert all(e.eraser and e.pen for e in stage.events)


def test_moving_without_a_button_hovers(stage):
    stage.mouse(QEvent.Type.MouseMove, (30, 40))
    stage.pen(QEvent.Type.TabletMove, (50, 60), pressure=0.0)
    assert stage.kinds == ["hover", "hover"]


@pytest.mark.parametrize("button", [MIDDLE, RIGHT])
def test_dragging_orbits_around_the_point_under_the_pointer(stage, button):
    viewport = stage.viewport
    start = stage.middle * (1.0, 1.25)
    pivot = viewport.pick(*start).point
    before = viewport.eye
    stage.mouse_drag(np.linspace(start, start + np.array([60, -20]), 8), button)
    after = viewport.eye
    assert stage.events == []
    assert after.azimuth != before.azimuth
    assert after.elevation < before.elevation
    assert np.abs(viewport.view().project(pivot)[0] - start).max() < 1.0


def test_shift_middle_pans_with_the_pointer(stage):
    viewport = stage.viewport
    start = stage.middle * (1.0, 1.25)
    point = viewport.pick(*start).point
    stage.mouse_drag(np.linspace(start, start + SHIFTED, 6), MIDDLE, SHIFT)
    assert np.abs(viewport.view().project(point)[0] - (start + SHIFTED)).max() < 1.0


def test_ctrl_middle_zooms(stage):
    before = stage.viewport.eye.distance
    stage.mouse_drag([(200, 300), (200, 250)], MIDDLE, CTRL)
    assert stage.viewport.eye.distance < before


@pytest.mark.parametrize("perspective", [True, False])
def test_wheel_zooms_to_the_pointer(stage, perspective):
    viewport = stage.viewport
    viewport.set_perspective(perspective)
    stage.settle()
    at = stage.middle * (0.7, 1.2)
    point = viewport.pick(*at).point
    before = viewport.eye.distance
    for _ in range(4):
        stage.wheel(at, 1.0)
    assert viewport.eye.distance == pytest.approx(before / 1.15**4)
    assert np.abs(viewport.view().project(point)[0] - at).max() < 1.0


def test_alt_wheel_belongs_to_the_level(stage, qtbot):
    before = stage.viewport.eye
    with qtbot.waitSignal(stage.viewport.alt_scrolled) as got:
        stage.wheel((100, 100), 2.0, ALT)
    assert got.args == [2.0]
    assert stage.viewport.eye is before


def test_two_fingers_on_the_touchpad_orbit_and_with_shift_pan(stage):
    viewport = stage.viewport
    before = viewport.eye
    stage.wheel(stage.middle, 0, pixels=(30, 10), device=touchpad())
    assert viewport.eye.azimuth != before.azimuth
    assert viewport.eye.distance == before.distance
    turned = viewport.eye
    stage.wheel(stage.middle, 0, SHIFT, pixels=(30, 10), device=touchpad())
    assert viewport.eye.azimuth == turned.azimuth
    assert (viewport.eye.centre != turned.centre).any()


def test_pen_barrel_orbits_with_shift_pans_with_ctrl_zooms_and_never_draws(stage):
    viewport = stage.viewport
    path = np.linspace(stage.middle, stage.middle + np.array([40, 30]), 6)
    eyes = [viewport.eye]
    for modifiers in (Qt.KeyboardModifier.NoModifier, SHIFT, CTRL):
        stage.pen_drag(path, RIGHT, modifiers)
        eyes.append(viewport.eye)
    assert eyes[1].azimuth != eyes[0].azimuth
    assert eyes[2].azimuth == eyes[1].azimuth
    assert (eyes[2].centre != eyes[1].centre).any()
    assert eyes[3].distance != eyes[2].distance
    assert stage.events == []


def test_pen_tip_touching_while_the_barrel_is_held_does_not_draw(stage):
    device = pen_device()
    both = LEFT | RIGHT
    stage.pen(QEvent.Type.TabletPress, (200, 200), RIGHT, RIGHT, device=device)
    stage.pen(QEvent.Type.TabletPress, (205, 200), LEFT, both, device=device)
    stage.pen(QEvent.Type.TabletMove, (230, 210), NONE, both, device=device)
    stage.pen(QEvent.Type.TabletRelease, (230, 210), LEFT, RIGHT, device=device)
    stage.pen(QEvent.Type.TabletRelease, (230, 210), RIGHT, NONE, device=device)
    assert stage.events == []
    stage.pen(QEvent.Type.TabletPress, (200, 200), LEFT, both, device=device)
    stage.pen(QEvent.Type.TabletRelease, (230, 210), LEFT, NONE, device=device)
    assert stage.events == []


def test_space_held_navigates_with_left_button_and_tip(stage):
    viewport = stage.viewport
    viewport.setFocus()
    eyes = [viewport.eye]
    QTest.keyPress(viewport, Qt.Key.Key_Space)
    stage.mouse_drag([(200, 200), (240, 210)])
    eyes.append(viewport.eye)
    stage.pen_drag([(200, 200), (240, 210)])
    eyes.append(viewport.eye)
    stage.mouse_drag([(200, 200), (240, 210)], modifiers=SHIFT)
    eyes.append(viewport.eye)
    QTest.keyRelease(viewport, Qt.Key.Key_Space)
    assert stage.events == []
    assert len({e.azimuth for e in eyes[:3]}) == 3
    assert eyes[3].azimuth == eyes[2].azimuth
    stage.mouse_drag([(200, 200), (240, 210)])
    assert stage.kinds == ["press", "move", "release"]
    assert viewport.eye is eyes[3]


def test_arrow_keys_turn(stage):
    before = stage.viewport.eye
    QTest.keyClick(stage.viewport, Qt.Key.Key_Right)
    QTest.keyClick(stage.viewport, Qt.Key.Key_Up)
    after = stage.viewport.eye
    assert after.azimuth != before.azimuth
    assert after.elevation > before.elevation


def test_a_gesture_that_loses_its_window_is_cancelled(stage, qtbot):
    stage.mouse(QEvent.Type.MouseButtonPress, (200, 200), LEFT, LEFT)
    with qtbot.waitSignal(stage.viewport.cancelled):
        stage.viewport.hide()
    stage.viewport.show()
    stage.settle()
    stage.mouse(QEvent.Type.MouseMove, (210, 200), NONE, NONE)
    assert stage.kinds == ["press", "hover"]


def test_another_button_does_not_end_a_stroke(stage):
    before = stage.viewport.eye
    stage.mouse(QEvent.Type.MouseButtonPress, (200, 200), LEFT, LEFT)
    stage.mouse(QEvent.Type.MouseButtonPress, (200, 200), MIDDLE, LEFT | MIDDLE)
    stage.mouse(QEvent.Type.MouseMove, (220, 220), NONE, LEFT | MIDDLE)
    stage.mouse(QEvent.Type.MouseButtonRelease, (220, 220), MIDDLE, LEFT)
    stage.mouse(QEvent.Type.MouseButtonRelease, (220, 220), LEFT, NONE)
    assert stage.kinds == ["press", "move", "release"]
    assert stage.viewport.eye is before


def test_one_finger_draws_and_two_fingers_move_the_camera(stage, qtbot):
    viewport = stage.viewport
    device = QTest.createTouchDevice()
    QTest.touchEvent(viewport, device).press(0, QPoint(200, 200)).commit()
    QTest.touchEvent(viewport, device).move(0, QPoint(210, 205)).commit()
    assert stage.kinds == ["press", "move"]
    before = viewport.eye
    with qtbot.waitSignal(viewport.cancelled):
        QTest.touchEvent(viewport, device).move(0, QPoint(210, 205)).press(
            1, QPoint(300, 200)
        ).commit()
    two = QTest.touchEvent(viewport, device)
    two.move(0, QPoint(190, 225)).move(1, QPoint(330, 220)).commit()
    after = viewport.eye
    QTest.touchEvent(viewport, device).move(0, QPoint(190, 225)).release(
        1, QPoint(330, 220)
    ).commit()
    QTest.touchEvent(viewport, device).release(0, QPoint(190, 225)).commit()
    assert after.azimuth != before.azimuth
    assert after.distance < before.distance
    assert stage.kinds == ["press", "move"]
    assert not viewport.hands.navigating
