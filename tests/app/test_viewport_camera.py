"""The camera: its numbers against VTK's, standard views, framing, flights."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QEvent

from tests.app.viewport_stage import MIDDLE, NONE, check_projection

pytestmark = pytest.mark.window


def test_view_is_what_vtk_projects(stage):
    check_projection(stage)


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
    qtbot.waitUntil(lambda: abs(viewport.eye.azimuth - np.pi / 2) < 1e-12)
    viewport.standard_view("top")
    qtbot.waitUntil(lambda: viewport.eye.elevation > 0.05)
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
