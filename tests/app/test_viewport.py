"""The viewport in a really rendered window: what it sees, what the hands do, what it costs."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QPolygonF
from PySide6.QtTest import QTest
from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

from engine import Mesh, load
from resources import sample_path
from tests.app.viewport_stage import (
    ALT,
    CTRL,
    LEFT,
    MIDDLE,
    NONE,
    RIGHT,
    SHIFT,
    Stage,
    check_projection,
    eraser_device,
    pen_device,
    sphere,
    torus,
    touchpad,
)

pytestmark = pytest.mark.window

SHIFTED = np.array([40, -25])


def seen_by_rays(viewport, mesh: Mesh, ids: np.ndarray) -> np.ndarray:
    """Whether nothing lies between each vertex and the eye, by casting rays."""
    data = viewport.scene.surface.data
    locator = vtkStaticCellLocator()
    locator.SetDataSet(data)
    locator.BuildLocator()
    place = viewport.scene.placement.to_scene(mesh.vertices)
    eye = viewport.eye
    t, part, cell = mutable(0.0), mutable(0), mutable(0)
    hit, coordinates = [0.0] * 3, [0.0] * 3
    size = np.ptp(place, axis=0).max()
    seen = []
    for i in ids:
        toward = eye.toward(place[i][None])[0]
        far = np.linalg.norm(eye.position - place[i]) if eye.perspective else 4 * size
        start, end = place[i] + 2e-6 * size * toward, place[i] + far * toward
        met = locator.IntersectWithLine(start, end, 1e-12, t, hit, coordinates, part, cell)
        seen.append(met == 0)
    return np.array(seen)


# What is seen


@pytest.mark.parametrize("perspective", [True, False])
@pytest.mark.parametrize("form", ["6k", "60k", "drill"])
def test_lasso_agrees_with_ray_casting(stage, perspective, form):
    mesh = load(sample_path("drill")) if form == "drill" else torus(int(form[:-1]) * 1000)
    viewport = stage.viewport
    viewport.set_perspective(perspective)
    viewport.set_mesh(mesh)
    lasso = np.array([[1.0, 1.0], [498.0, 1.0], [498.0, 398.0], [1.0, 398.0]])
    inside = viewport.vertices_inside(lasso, through=True)
    chosen = viewport.vertices_inside(lasso)
    some = np.random.default_rng(0).choice(inside, 3000, replace=False)
    agree = seen_by_rays(viewport, mesh, some) == np.isin(some, chosen)
    assert agree.mean() >= 0.99


def test_no_vertex_of_the_back_of_a_sphere_is_selected(qtbot):
    mesh = sphere(20_000)
    stage = Stage(mesh)
    viewport = stage.viewport
    lasso = np.array([[0.0, 0.0], [500.0, 0.0], [500.0, 400.0], [0.0, 400.0]])
    chosen = viewport.vertices_inside(lasso)
    everything = viewport.vertices_inside(lasso, through=True)
    toward = viewport.eye.toward(viewport.scene.placement.to_scene(mesh.vertices))
    side = (mesh.vertices / 10.0 * toward).sum(axis=1)
    edge = 2 * np.pi / 200  # a triangle on the outline reaches so far around it
    stage.close()
    assert len(everything) == mesh.n
    assert side[chosen].min() > -edge
    assert np.isin(np.flatnonzero(side > edge), chosen).mean() > 0.999


def test_lasso_takes_what_lies_inside_it_and_nothing_else(stage):
    lasso = stage.ellipse()
    chosen = stage.viewport.vertices_inside(lasso)
    through = stage.viewport.vertices_inside(lasso, through=True)
    px = stage.viewport.view().project(stage.viewport.vertices[through])
    polygon = QPolygonF([QPointF(x, y) for x, y in lasso])
    inside = [polygon.containsPoint(QPointF(x, y), Qt.FillRule.WindingFill) for x, y in px]
    assert 0 < len(chosen) < len(through)
    assert np.isin(chosen, through).all()
    assert np.mean(inside) > 0.98
    assert (np.diff(chosen) > 0).all()


def test_lasso_outside_the_picture_or_too_short_takes_nothing(stage):
    assert len(stage.viewport.vertices_inside(np.zeros((2, 2)))) == 0
    assert len(stage.viewport.vertices_inside([[-90, -90], [-10, -90], [-10, -10]])) == 0


def test_pick_gives_the_point_under_the_pixel(stage):
    viewport = stage.viewport
    x, y = stage.middle * (1.0, 1.25)
    hit = viewport.pick(x, y)
    assert hit is not None
    assert np.abs(viewport.view().project(hit.point)[0] - (x, y)).max() < 1e-6
    corners = viewport.form.faces[hit.face]
    assert hit.vertex in corners
    near = np.linalg.norm(viewport.view().project(viewport.vertices[corners]) - (x, y), axis=1)
    assert hit.vertex == corners[np.argmin(near)]
    assert viewport.pick(2, 2) is None
    assert viewport.pick(-5, 1e6) is None


def test_pick_of_a_form_far_from_the_origin_keeps_its_digits(qtbot):
    stage = Stage(torus(4000, size=0.04, offset=1e6))
    x, y = stage.middle * (1.0, 1.25)
    hit = stage.viewport.pick(x, y)
    assert hit is not None
    assert np.abs(stage.viewport.view().project(hit.point)[0] - (x, y)).max() < 0.01
    stage.close()


def test_faces_under_a_path_come_in_its_order(stage):
    viewport = stage.viewport
    start = np.floor(stage.middle * (0.75, 1.3)) + 0.5
    end = np.floor(stage.middle * (1.25, 1.3)) + 0.5
    path = np.linspace(start, end, 12)
    faces = viewport.faces_under(path)
    centres = viewport.view().project(viewport.vertices[viewport.form.faces[faces]].mean(axis=1))
    assert len(faces) > 10
    assert (np.diff(faces) != 0).all()
    assert faces[0] == viewport.pick(*start).face
    assert faces[-1] == viewport.pick(*end).face
    assert np.corrcoef(centres[:, 0], np.arange(len(faces)))[0, 1] > 0.99
    assert (viewport.faces_under(path[::-1]) == faces[::-1]).mean() > 0.9
    assert len(viewport.faces_under([[1, 1], [3, 1]])) == 0


def test_brush_touches_visible_vertices_within_its_radius(stage):
    x, y = stage.middle * (1.0, 1.25)
    touched = stage.viewport.vertices_near(x, y, 30)
    px = stage.viewport.view().project(stage.viewport.vertices[touched])
    assert len(touched) > 10
    assert np.linalg.norm(px - (x, y), axis=1).max() <= 30


def test_the_image_of_triangles_is_taken_once_for_each_view(stage):
    viewport = stage.viewport
    first = viewport.sight()
    assert viewport.sight() is first
    viewport.turn_by(0.2, 0.0)
    second = viewport.sight()
    assert second is not first
    moved = viewport.vertices.copy()
    moved[:, 2] += 3.0
    viewport.set_vertices(moved)
    assert viewport.sight() is not second


def test_works_after_a_resize(qtbot):
    stage = Stage(torus(6000))
    before = len(stage.viewport.vertices_inside(stage.ellipse()))
    stage.window.resize(640, 520)
    qtbot.waitUntil(lambda: stage.viewport.width() == 640)
    stage.settle()
    view = stage.viewport.view()
    assert view.size == (640.0, 520.0)
    assert stage.viewport.overlay.size() == stage.viewport.size()
    after = stage.viewport.vertices_inside(stage.ellipse())
    x, y = stage.middle * (1.0, 1.25)
    hit = stage.viewport.pick(x, y)
    stage.close()
    assert 0.4 * before < len(after) < 2.5 * before
    assert np.abs(view.project(hit.point)[0] - (x, y)).max() < 1e-6


# The camera as numbers


def test_view_is_what_vtk_projects(stage):
    check_projection(stage)


@pytest.mark.parametrize("scale", ["1.25", "1.5", "2"])
def test_view_is_what_vtk_projects_at_scale(scale):
    """In a process of its own: Qt reads the scale factor once, when it starts."""
    ran = subprocess.run(
        [sys.executable, "-m", "tests.app.viewport_stage", scale],
        env={**os.environ, "QT_SCALE_FACTOR": scale},
        cwd=Path(__file__).resolve().parents[2],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert f"the projection holds at {float(scale)}" in ran.stdout


# Hands


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


# Views


def test_standard_views_look_along_the_axes(stage):
    viewport = stage.viewport
    for name, toward in (("front", (0, -1, 0)), ("right", (1, 0, 0)), ("top", (0, 0, 1))):
        viewport.standard_view(name, animate=False)
        assert np.abs(viewport.eye.axes[2] - toward).max() < 1e-12
        px = viewport.view().project(np.zeros((1, 3)))[0]
        assert np.abs(px - stage.middle).max() < 0.5 * stage.middle.max()


def test_y_up_forms_stand_upright(stage):
    viewport = stage.viewport
    viewport.set_up_axis("y")
    viewport.standard_view("front", animate=False)
    assert np.abs(viewport.eye.axes[1] - (0, 1, 0)).max() < 1e-12
    assert np.abs(viewport.eye.axes[2] - (0, 0, 1)).max() < 1e-12


@pytest.mark.parametrize("perspective", [True, False])
def test_framing_brings_the_form_or_the_region_into_the_picture(stage, perspective):
    viewport = stage.viewport
    viewport.set_perspective(perspective)
    viewport.look(viewport.eye.panned(500, 80), animate=False)
    viewport.frame(animate=False)
    px = viewport.view().project(viewport.vertices)
    size = np.array(viewport.view().size)
    assert (px > 0).all()
    assert (px < size).all()
    assert (np.ptp(px, axis=0) / size).max() > 0.6
    ids = viewport.vertices_inside(stage.ellipse(0.1))
    viewport.frame(ids, animate=False)
    px = viewport.view().project(viewport.vertices[ids])
    assert (px > 0).all()
    assert (px < size).all()
    assert (np.ptp(px, axis=0) / size).max() > 0.5


def test_a_flight_arrives_and_a_hand_interrupts_it(stage, qtbot):
    viewport = stage.viewport
    viewport.standard_view("right")
    qtbot.waitUntil(lambda: abs(viewport.eye.azimuth - np.pi / 2) < 1e-12, timeout=5000)
    viewport.standard_view("top")
    qtbot.waitUntil(lambda: viewport.eye.elevation > 0.05, timeout=5000)
    stage.mouse(QEvent.Type.MouseButtonPress, (100, 100), MIDDLE, MIDDLE)
    held = viewport.eye
    qtbot.wait(300)
    assert viewport.eye is held
    stage.mouse(QEvent.Type.MouseButtonRelease, (100, 100), MIDDLE, NONE)


def test_perspective_and_orthographic_show_the_centre_alike(stage):
    viewport = stage.viewport
    right, up, _ = viewport.eye.axes
    across = viewport.scene.placement.to_mesh(viewport.eye.centre + np.stack([right, up]))
    first = viewport.view().project(across)
    viewport.set_perspective(False)
    assert not viewport.perspective
    assert np.abs(viewport.view().project(across) - first).max() < 1e-6


# What it costs


def test_at_most_one_render_for_each_frame(stage, qtbot):
    viewport = stage.viewport
    stage.settle()
    started = [0]
    tag = viewport.render_window.AddObserver(
        "StartEvent", lambda *_: started.__setitem__(0, started[0] + 1)
    )
    before = viewport.renders
    for k in range(20):
        viewport.turn_by(0.01, 0.0)
        viewport.set_vertices(viewport.vertices * (1 + 1e-4 * k))
        viewport.render()
    qtbot.waitUntil(lambda: viewport.renders > before)
    assert viewport.renders == before + 1
    assert started[0] == viewport.renders - before
    viewport.render_window.RemoveObserver(tag)


def test_a_live_stroke_renders_nothing(stage, qtbot):
    viewport = stage.viewport
    stage.settle()
    before, painted = viewport.renders, viewport.overlay.paints
    path = stage.ellipse()
    for k in range(2, len(path)):
        viewport.ink(path[:k], "region")
        now = viewport.overlay.paints
        qtbot.waitUntil(lambda now=now: viewport.overlay.paints > now)
    viewport.clear_ink()
    qtbot.wait(30)
    assert viewport.overlay.paints >= painted + len(path) - 2
    assert viewport.renders == before


def test_ink_is_on_the_screen(stage, qtbot):
    viewport = stage.viewport
    stage.settle()
    screen = viewport.screen()
    plain = screen.grabWindow(viewport.window().winId()).toImage()
    viewport.ink(stage.ellipse(), "target")
    now = viewport.overlay.paints
    qtbot.waitUntil(lambda: viewport.overlay.paints > now)
    qtbot.wait(50)
    inked = screen.grabWindow(viewport.window().winId()).toImage()
    x, y = (int(c) for c in stage.ellipse()[0])
    assert plain.pixelColor(x, y) != inked.pixelColor(x, y)
    assert inked.pixelColor(x, y).red() > inked.pixelColor(x, y).blue()


def test_moving_some_vertices_is_the_same_as_moving_all(stage):
    viewport = stage.viewport
    ids = viewport.vertices_inside(stage.ellipse())
    moved = viewport.vertices.copy()
    moved[ids] += (0.0, 0.0, 2.5)
    viewport.set_vertices(moved[ids], ids)
    partial = [a.copy() for a in (viewport.scene.surface.positions, viewport.scene.surface.normals)]
    viewport.set_vertices(viewport.form.vertices)
    viewport.set_vertices(moved)
    assert np.abs(viewport.scene.surface.positions - partial[0]).max() == 0
    assert np.abs(viewport.scene.surface.normals - partial[1]).max() < 1e-5
    assert (viewport.vertices == moved).all()


def test_what_comes_after_closing_does_no_harm(qtbot):
    stage = Stage(torus(2000))
    viewport = stage.viewport
    where = viewport.vertices.copy()
    viewport.close()
    viewport.set_vertices(where * 1.1)
    viewport.set_region(np.arange(20))
    viewport.turn_by(0.1, 0.0)
    viewport.render()
    assert viewport.pick(10, 10) is None
    assert len(viewport.vertices_inside(stage.ellipse())) == 0
    stage.close()


def test_nothing_of_vtk_outlives_the_window(qtbot):
    def actors() -> int:
        gc.collect()
        return sum(type(o).__name__ in ("vtkOpenGLActor", "vtkActor") for o in gc.get_objects())

    before = actors()
    stage = Stage(torus(3000))
    viewport = stage.viewport
    ids = viewport.vertices_inside(stage.ellipse())
    viewport.set_region(ids)
    viewport.ghost(viewport.vertices + np.array([0, 0, 3]))
    viewport.show_curve("a", viewport.vertices[ids[:20]], "source")
    viewport.set_pins(viewport.vertices[ids[:2]])
    viewport.set_mesh(torus(2000))
    stage.close()
    del viewport
    stage.__dict__.clear()
    assert actors() <= before
