"""What the viewport costs: renders for each frame, strokes without any, nothing left at its end."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from PySide6.QtGui import QColor

from tests.app.viewport_stage import Stage, torus

pytestmark = pytest.mark.window


def test_at_most_one_render_for_each_frame(stage, qtbot):
    viewport = stage.viewport
    stage.settle()
    started = [0]
    tag = viewport.render_window.AddObserver(
        "StartEvent", lambda *_: started.__setitem__(0, started[0] + 1)
    )
    before = viewport.renders
    frames: list[int] = []
    # Told once the frame is there, before the better one at rest can follow.
    told = viewport.frameSwapped.connect(lambda: frames.append(viewport.renders))
    for k in range(20):
        viewport.turn_by(0.01, 0.0)
        viewport.set_vertices(viewport.vertices * (1 + 1e-4 * k))
        viewport.render()
    qtbot.waitUntil(lambda: bool(frames))
    assert frames[0] == before + 1
    assert started[0] == viewport.renders - before
    viewport.disconnect(told)
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
    x, y = (int(c) for c in stage.ellipse()[0])

    def seen() -> QColor:
        return screen.grabWindow(viewport.window().winId()).toImage().pixelColor(x, y)

    plain = seen()
    viewport.ink(stage.ellipse(), "target")
    qtbot.waitUntil(lambda: seen() != plain)
    assert seen().red() > seen().blue()


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
