"""What the viewport shows: displays, maps, curves, pictures, the cube."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest

from app.look import DARK, LIGHT, RIM, SOURCE, rgb8
from app.viewport import Viewport, maps
from app.viewport.camera import Eye
from app.viewport.idimage import capture, captured_by_selector
from app.viewport.shading import mapped, round_up, signed_deviation, signed_mean_curvature
from engine import Mesh
from tests.app.viewport_stage import LEFT, MIDDLE, NONE, Stage, sphere, torus

pytestmark = pytest.mark.window


def pixels(image: QImage) -> np.ndarray:
    """RGBA of a picture, (h, w, 4)."""
    image = image.convertToFormat(QImage.Format.Format_RGBA8888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, : 4 * image.width()].reshape(image.height(), image.width(), 4).copy()


def picture(viewport: Viewport, size: tuple[int, int] = (300, 240)) -> np.ndarray:
    return pixels(viewport.render_image(size))[..., :3].astype(int)


def near(image: np.ndarray, colour: str, within: int = 60) -> int:
    """How many pixels have nearly a colour."""
    return int((np.abs(image - np.array(rgb8(colour))).max(axis=-1) < within).sum())


# Displays and maps


def test_every_display_gives_another_picture(stage, artefacts):
    viewport = stage.viewport
    moved = viewport.form.vertices.copy()
    moved[:, 2] *= 1.1
    viewport.set_vertices(moved)
    seen = []
    for name in ("clay", "zebra", "reflection", "curvature", "deviation"):
        viewport.set_display(name)
        assert viewport.display == name
        viewport.render_image((900, 700)).save(str(artefacts / f"{name}.png"))
        seen.append(picture(viewport))
    viewport.set_display("clay")
    viewport.set_wireframe(True)
    seen.append(picture(viewport))
    viewport.set_wireframe(False)
    for i in range(len(seen)):
        for j in range(i):
            assert np.abs(seen[i] - seen[j]).mean() > 0.5
    assert np.abs(picture(viewport) - seen[0]).mean() < 0.1


def test_zebra_is_black_and_white_stripes(stage):
    stage.viewport.set_display("zebra")
    image = picture(stage.viewport)
    on_form = image[120:170, 100:200].reshape(-1, 3)
    assert (on_form.max(axis=1) < 60).mean() > 0.08
    assert (on_form.min(axis=1) > 150).mean() > 0.08


def test_zebra_does_not_disturb_picking(stage):
    viewport = stage.viewport
    before = viewport.sight().ids
    viewport.set_display("zebra")
    viewport.set_wireframe(True)
    viewport._sight = None
    assert (viewport.sight().ids == before).all()


def test_deviation_is_signed_millimetres_with_a_scale(stage):
    viewport = stage.viewport
    normals = viewport.form.vertex_normals
    viewport.set_vertices(viewport.form.vertices + 1.4 * normals)
    viewport.set_display("deviation")
    assert np.abs(viewport.deviation() - 1.4).max() < 1e-6
    legend = viewport.overlay.legend
    assert (legend.title, legend.low, legend.middle, legend.high) == (
        "Deviation, mm",
        "−1.5",
        "0",
        "+1.5",
    )
    viewport.set_vertices(viewport.form.vertices - 1.4 * normals)
    assert np.abs(viewport.deviation() + 1.4).max() < 1e-6
    viewport.set_reference(viewport.vertices)
    assert np.abs(viewport.deviation()).max() == 0
    viewport.set_display("clay")
    assert viewport.overlay.legend is None


def test_mean_curvature_of_a_sphere_is_one_over_its_radius():
    curvature = signed_mean_curvature(sphere(4000, radius=10.0))
    assert np.abs(np.median(curvature) - 0.1) < 0.002
    inside_out = sphere(4000, radius=10.0)
    turned = Mesh(inside_out.vertices, inside_out.faces[:, ::-1])
    assert np.abs(np.median(signed_mean_curvature(turned)) + 0.1) < 0.002


def test_curvature_of_a_large_form_is_worked_out_beside_the_window(stage, qtbot, monkeypatch):
    viewport = stage.viewport
    viewport.set_display("curvature")
    at_once = viewport.scene.surface.colours.copy()
    viewport.set_display("clay")
    threads = []

    def noted(mesh: Mesh) -> np.ndarray:
        threads.append(threading.current_thread())
        return signed_mean_curvature(mesh)

    monkeypatch.setattr(maps, "AT_ONCE", 100)
    monkeypatch.setattr(maps, "signed_mean_curvature", noted)
    viewport.set_display("curvature")
    assert viewport.moving
    qtbot.waitUntil(lambda: not viewport.maps.under_way)
    assert threads
    assert threading.main_thread() not in threads
    assert (viewport.scene.surface.colours == at_once).all()
    assert viewport.overlay.legend.title == "Mean curvature, 1/mm"
    # The form moves and rests: another; what comes late, for another display, changes nothing.
    viewport.set_vertices(viewport.vertices * 1.1)
    qtbot.waitUntil(lambda: len(threads) == 2)
    viewport.set_display("clay")
    plain = viewport.scene.surface.colours.copy()
    qtbot.waitUntil(lambda: not any(one.is_alive() for one in threads))
    stage.settle()
    assert (viewport.scene.surface.colours == plain).all()
    assert viewport.overlay.legend is None


def test_deviation_follows_only_what_moves(stage, monkeypatch):
    viewport = stage.viewport
    viewport.set_display("deviation")
    ids = viewport.vertices_inside(stage.ellipse(0.2))
    normals = viewport.form.vertex_normals[ids]
    viewport.set_vertices(viewport.vertices[ids] + normals, ids)
    asked = []

    def noted(positions: np.ndarray, *given: np.ndarray) -> np.ndarray:
        asked.append(len(positions))
        return signed_deviation(positions, *given)

    monkeypatch.setattr(maps, "signed_deviation", noted)
    viewport.set_vertices(viewport.vertices[ids] - 0.5 * normals, ids)
    assert asked == [len(ids)]
    assert len(ids) < viewport.form.n / 4
    monkeypatch.undo()
    followed = viewport.scene.surface.colours.copy()
    assert (followed == mapped(viewport.deviation(), 1.0)).all()
    assert len(np.unique(followed, axis=0)) > 1


def test_map_runs_from_blue_over_white_to_orange():
    blue, white, orange = mapped([-3.0, 0.0, 3.0], 2.0).astype(int)
    assert blue[2] > blue[0] + 80
    assert white.min() > 230
    assert orange[0] > orange[2] + 80
    assert [round_up(x) for x in (0.03, 0.11, 1.0, 2.1, 70.0)] == [0.03, 0.15, 1.0, 3.0, 80.0]


# The region, curves, ghost


def test_region_is_tinted_and_its_rim_drawn(stage):
    viewport = stage.viewport
    plain = picture(viewport)
    ids = viewport.vertices_inside(stage.ellipse(0.2))
    viewport.set_region(ids)
    marked = picture(viewport)
    assert near(marked, RIM) > 60
    assert near(plain, RIM) == 0
    x, y = (viewport.view().project(viewport.vertices[ids]).mean(axis=0) * 0.6).astype(int)
    tinted = marked[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3).mean(axis=0)
    clay = plain[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3).mean(axis=0)
    assert tinted[2] - tinted[1] > clay[2] - clay[1] + 15
    viewport.set_region(None)
    assert np.abs(picture(viewport) - plain).max() <= 2


def test_another_region_is_painted_as_if_it_were_the_first(stage):
    viewport = stage.viewport
    ids = viewport.vertices_inside(stage.ellipse(0.3))
    rest = np.setdiff1d(np.arange(viewport.form.n), ids)
    for after in (rest, ids, ids[: len(ids) // 2], ids):
        viewport.set_region(after)
        painted = viewport.scene.surface.colours.copy()
        viewport.set_region(None)
        viewport.set_region(after)
        assert (viewport.scene.surface.colours == painted).all()


def test_border_of_the_region_is_feathered_on_screen_only(stage):
    viewport = stage.viewport
    ids = viewport.vertices_inside(stage.ellipse(0.3))
    viewport.set_region(ids)
    weight = viewport.scene._tint.weight
    assert weight[ids].min() > 0.0
    assert weight.max() == pytest.approx(1.0)
    assert ((weight > 0.05) & (weight < 0.95)).sum() > 50
    outside = np.setdiff1d(np.arange(viewport.form.n), ids)
    assert weight[outside].mean() < 0.05


def test_source_lies_on_the_form_and_is_hidden_behind_it(stage):
    viewport = stage.viewport
    line = np.linspace(stage.middle * (0.8, 1.3), stage.middle * (1.2, 1.3), 12)
    points = np.array([viewport.pick(*at).point for at in line])
    viewport.show_curve("s", points, "source")
    assert near(picture(viewport), SOURCE, 70) > 40
    viewport.look(viewport.eye.orbited(viewport.eye.centre, np.pi, 0.0), animate=False)
    assert near(picture(viewport), SOURCE, 40) == 0
    viewport.hide_curve("s")
    assert "s" not in viewport.scene.marks.curves


def test_thickness_of_a_curve_is_the_same_at_any_zoom(stage):
    viewport = stage.viewport
    line = np.linspace(stage.middle * (0.9, 1.3), stage.middle * (1.1, 1.3), 8)
    viewport.show_curve("s", [viewport.pick(*at).point for at in line], "source")
    widths = []
    for factor in (1.0, 4.0):
        viewport.look(viewport.eye.zoomed((0, 0, 0), factor), animate=False)
        solid = viewport.scene.marks.curves["s"].solids[0]
        place = solid._data.GetPoints().GetBounds()
        assert np.isfinite(place).all()
        unit = viewport.eye.unit_per_pixel(solid.points, viewport.view_height())
        first = np.array([solid._data.GetPoint(k) for k in range(12)])
        widths.append(np.ptp(first, axis=0).max() / unit[0])
    assert widths[0] == pytest.approx(widths[1], rel=0.02)
    assert 3.5 < widths[0] < 6.0


def test_ghost_is_seen_only_where_the_form_differs(stage):
    viewport = stage.viewport
    viewport.ghost(viewport.vertices)
    assert viewport.scene.ghost is None
    ids = viewport.vertices_inside(stage.ellipse(0.2))
    moved = viewport.vertices[ids] * 0.85
    viewport.set_vertices(moved, ids)
    ghost = viewport.scene.ghost
    assert ghost is not None
    assert len(ghost.faces) < 0.3 * len(viewport.form.faces)
    without = picture(viewport)
    viewport.ghost(None)
    assert np.abs(picture(viewport) - without).max() > 10


def test_a_new_mesh_takes_away_what_lay_on_the_old_one(stage):
    viewport = stage.viewport
    viewport.set_region(viewport.vertices_inside(stage.ellipse()))
    viewport.show_curve("s", viewport.vertices[:5], "source")
    viewport.ghost(viewport.vertices * 1.2)
    viewport.set_mesh(torus(3000))
    assert viewport.renderer.GetActors().GetNumberOfItems() == 1


# Pictures, measures, tracing


def test_picture_has_the_size_asked_for_and_may_be_transparent(stage):
    viewport = stage.viewport
    before = viewport.render_window.GetSize()
    seen = pixels(viewport.render_image((640, 360), transparent=True))
    assert seen.shape == (360, 640, 4)
    assert (seen[:5, :5, 3] == 0).all()
    assert (seen[..., 3] == 255).mean() > 0.1
    partly = (seen[..., 3] > 20) & (seen[..., 3] < 235)
    assert partly.sum() > 50  # edges are smooth
    solid = pixels(viewport.render_image((640, 360)))
    assert (solid[..., 3] == 255).all()
    assert viewport.render_window.GetSize() == before
    stage.settle()
    assert viewport.pick(*(stage.middle * (1.0, 1.25))) is not None


def test_picture_to_trace_is_placed_and_faded(stage):
    viewport = stage.viewport
    red = QImage(200, 100, QImage.Format.Format_RGB32)
    red.fill(0xFFFF0000)
    viewport.set_backdrop(red, opacity=0.5)
    place = viewport.overlay.backdrop.place
    assert place.width() == pytest.approx(2 * place.height())
    assert viewport.rect().contains(place.toRect())
    viewport.fade_backdrop(1.0)
    viewport.set_backdrop(red, 1.0, QRectF(10, 10, 40, 20))
    stage.wait(lambda: viewport.overlay.isVisible())
    grabbed = viewport.overlay.grab(viewport.overlay.rect()).toImage()
    assert grabbed.pixelColor(30, 20).red() > 200
    viewport.set_backdrop(None)
    assert viewport.overlay.backdrop is None


def test_the_invitation_goes_at_the_first_stroke(stage):
    viewport = stage.viewport
    viewport.overlay.set_invitation(stage.ellipse())
    assert viewport.overlay.inviting
    stage.mouse(QEvent.Type.MouseMove, (100, 100))
    assert viewport.overlay.inviting
    stage.mouse_drag([(100, 100), (120, 100)])
    assert not viewport.overlay.inviting


def test_ink_pixels_do_not_depend_on_how_it_grew(stage):
    overlay = stage.viewport.overlay
    path = stage.ellipse()
    for k in range(2, len(path) + 1):
        overlay.ink(path[:k], "region")
        QTest.qWait(1)
    grown = overlay.grab().toImage()
    overlay.clear_ink()
    overlay.ink(path, "region")
    assert grown == overlay.grab().toImage()


# The cube, the turntable, linked views


def test_a_click_on_the_cube_looks_straight_at_that_side(stage):
    viewport = stage.viewport
    viewport.look(viewport.eye.orbited(viewport.eye.centre, 0.0, 0.2), animate=False)
    corners = viewport.cube._corners("right")
    at = corners.mean(axis=0)
    assert viewport.cube.face_at(QPointF(*at)) == "right"
    assert viewport.cube.face_at(QPointF(0, 0)) == ""
    QTest.mouseClick(viewport.cube, LEFT, pos=QPoint(*at.astype(int)))
    stage.wait(lambda: abs(viewport.eye.azimuth - np.pi / 2) < 1e-9)
    assert viewport.eye.elevation == pytest.approx(0.0)
    assert stage.events == []


def test_dragging_the_cube_turns_the_form(stage):
    viewport = stage.viewport
    before = viewport.eye
    QTest.mousePress(viewport.cube, LEFT, pos=QPoint(40, 40))
    QTest.mouseMove(viewport.cube, QPoint(55, 46))
    QTest.mouseRelease(viewport.cube, LEFT, pos=QPoint(55, 46))
    assert viewport.eye.azimuth != before.azimuth


@pytest.mark.parametrize("up", [1, 2])
def test_the_cube_shows_the_side_that_one_looks_at(stage, up):
    names = {"front": (0, 0), "right": (90, 0), "top": (0, 90), "back": (180, 0)}
    cube = stage.viewport.cube
    for name, (azimuth, elevation) in names.items():
        cube.follow(Eye(np.zeros(3), 1.0, np.radians(azimuth), np.radians(elevation), up=up))
        assert cube.face_at(QPointF(46, 46)) == name
        corners = cube._corners(name)
        assert corners[0][0] < corners[1][0]  # written from left to right
        assert corners[0][1] < corners[3][1]  # and from top to bottom


def test_the_turntable_turns_until_a_hand_takes_hold(stage):
    viewport = stage.viewport
    start = viewport.eye.azimuth
    viewport.set_turntable(True)
    stage.wait(lambda: abs(viewport.eye.azimuth - start) > 0.02)
    assert viewport.turntable
    stage.mouse(QEvent.Type.MouseButtonPress, (100, 100), MIDDLE, MIDDLE)
    assert not viewport.turntable
    stage.mouse(QEvent.Type.MouseButtonRelease, (100, 100), MIDDLE, NONE)


def test_linked_views_look_from_the_same_place(qtbot, stage):
    other = Stage(torus(3000), (300, 240))
    stage.viewport.link(other.viewport)
    stage.viewport.turn_by(0.4, 0.1)
    a, b = stage.viewport, other.viewport
    assert b.eye.azimuth == a.eye.azimuth
    assert (
        np.abs(
            b.scene.placement.to_mesh(b.eye.position) - a.scene.placement.to_mesh(a.eye.position)
        ).max()
        < 1e-6
    )
    b.turn_by(-0.3, 0.0)
    assert a.eye.azimuth == pytest.approx(b.eye.azimuth)
    other.close()
    a.turn_by(0.1, 0.0)  # whoever is left looks where it likes


# The image of triangles


def test_one_render_tells_the_same_as_the_hardware_selector(stage):
    viewport = stage.viewport
    parts = viewport.render_window, viewport.renderer, viewport.scene.surface.actor
    assert (capture(*parts) == captured_by_selector(*parts)).all()


def test_picking_does_not_change_the_picture(stage):
    viewport = stage.viewport
    before = picture(viewport)
    viewport._sight = None
    viewport.pick(*stage.middle)
    assert np.abs(picture(viewport) - before).max() == 0


def test_occlusion_darkens_grooves_and_is_left_off_on_a_processor(stage, monkeypatch):
    viewport = stage.viewport
    if viewport.software:
        assert not viewport.occlusion_available
        assert not viewport.set_occlusion(True)
        monkeypatch.setattr(viewport, "_software", False)
    plain = picture(viewport)
    assert viewport.set_occlusion(True)
    occluded = picture(viewport)
    viewport.set_occlusion(False)
    assert occluded[120:170, 60:240].mean() < plain[120:170, 60:240].mean() - 0.5
    assert np.abs(picture(viewport) - plain).mean() < 0.5


def test_theme_changes_the_ground(stage):
    viewport = stage.viewport
    viewport.set_theme(LIGHT)
    light = picture(viewport)[3, 150]
    viewport.set_theme(DARK)
    dark = picture(viewport)[3, 150]
    assert np.abs(light - np.array(rgb8(LIGHT.sky))).max() < 8
    assert np.abs(dark - np.array(rgb8(DARK.sky))).max() < 8


def test_the_gradient_has_no_bands(stage):
    image = picture(stage.viewport, (64, 900))
    column = image[:, 2, 0]
    steps = np.flatnonzero(np.diff(column) != 0)
    assert np.diff(steps).max() < 60  # dithered: no long flat stretch with one hard step


def test_space_shows_that_one_navigates(stage):
    viewport = stage.viewport
    viewport.setCursor(Qt.CursorShape.CrossCursor)
    QTest.keyPress(viewport, Qt.Key.Key_Space)
    assert viewport.cursor().shape() == Qt.CursorShape.SizeAllCursor
    QTest.keyRelease(viewport, Qt.Key.Key_Space)
    assert viewport.cursor().shape() == Qt.CursorShape.CrossCursor
