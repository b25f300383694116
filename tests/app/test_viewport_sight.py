"""What the viewport says is seen: lassos, picks and brushes against ray casting."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QPolygonF
from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

from engine import Mesh, load
from resources import sample_path
from tests.app.viewport_stage import Stage, sphere, torus

pytestmark = pytest.mark.window


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


def test_what_was_worked_out_ahead_is_what_would_be_found_when_asked(stage, monkeypatch):
    viewport, lasso = stage.viewport, stage.ellipse()
    viewport.set_mesh(torus(20_000))
    brushes = [(*(stage.middle * at), 40.0) for at in ((1.0, 1.25), (0.8, 1.0), (0.0, 0.1))]

    def answers():
        yield viewport.vertices_inside(lasso)
        yield viewport.vertices_inside(lasso, through=True)
        for brush in brushes:
            yield viewport.vertices_near(*brush)
            yield viewport.vertices_near(*brush, through=True)

    asked = list(answers())
    sight = viewport.sight()
    assert not sight.ready
    monkeypatch.setattr("app.viewport.picking.GLANCE", 1000)
    sight.prepare()
    assert sight.ready
    looked = []
    monkeypatch.setattr("app.viewport.picking.visible", lambda *given: looked.append(given))
    assert all(np.array_equal(*pair) for pair in zip(answers(), asked, strict=True))
    assert not looked, "it is looked up, not worked out again"
    assert len(asked[0]) > 100


def test_what_nobody_wants_any_more_is_not_worked_out_to_its_end(stage, monkeypatch):
    viewport = stage.viewport
    sight = viewport.sight()
    monkeypatch.setattr("app.viewport.picking.GLANCE", 100)
    left = iter([True, True, False])
    sight.prepare(lambda: next(left))
    assert not sight.ready


def test_a_brush_takes_what_lies_within_its_circle(stage):
    viewport, (x, y) = stage.viewport, stage.middle * (1.0, 1.25)
    px = viewport.view().project(viewport.vertices)
    inside = (px >= 0).all(axis=1) & (px < (viewport.width(), viewport.height())).all(axis=1)
    for at, radius in (((x, y), 30.0), ((x, y), 900.0), ((3.0, y), 200.0), ((-50.0, -50.0), 20.0)):
        near = inside & (np.linalg.norm(px - at, axis=1) <= radius)
        assert np.array_equal(viewport.vertices_near(*at, radius, True), np.flatnonzero(near))


def test_a_region_in_other_colours_is_seen_as_before(stage):
    viewport = stage.viewport
    sight = viewport.sight()
    viewport.set_region(viewport.vertices_inside(stage.ellipse()))
    assert viewport.sight() is sight
    viewport.set_vertices(viewport.vertices * 1.01)
    assert viewport.sight() is not sight


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
    outside = [[-5.0, 10.0], [10.0, -0.5], [viewport.width() + 0.5, 10.0], [1e9, 1e9], [1.0, 1.0]]
    middles = np.floor(path) + 0.5
    found = viewport.faces_at([*middles, *outside])
    assert found[:12].tolist() == [viewport.pick(*point).face for point in middles]
    assert (found[12:] == -1).all()


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
