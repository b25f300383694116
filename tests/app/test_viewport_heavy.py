"""A form too heavy to be drawn in a moment: a lighter one in motion, pieces of it at rest."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from scipy.ndimage import median_filter

from app.viewport import moving, pieces
from app.viewport.heavy import HEAVY_FACES, _own, lightened, parts_of, placed, prepare
from app.viewport.idimage import capture
from app.viewport.standin import with_kept
from engine import Mesh
from tests.app.viewport_stage import Stage, sphere, torus

pytestmark = pytest.mark.window


@pytest.fixture(scope="module")
def heavy_stage(qapp):
    made = Stage(torus(90_000))
    assert len(made.viewport.form.faces) > HEAVY_FACES
    yield made
    made.close()


@pytest.fixture
def heavy(heavy_stage, qtbot, monkeypatch):
    monkeypatch.setattr(moving, "SLOW_FRAME_MS", 0.0)  # on a graphics card: as on a slow one
    heavy_stage.viewport.set_mesh(torus(90_000))
    heavy_stage.settle()
    heavy_stage.events.clear()
    return heavy_stage


def test_a_heavy_form_turns_as_a_lighter_one_and_rests_as_itself(heavy):
    viewport = heavy.viewport
    viewport.turn_by(0.01, 0.0)
    viewport.repaint()
    assert viewport.scene.standing_in
    light = viewport.scene.stand_in.surface
    assert light.n < 0.7 * viewport.form.n
    assert not viewport.scene.surface.actor.GetVisibility()
    sight = viewport.sight()
    assert sight.ids.max() > len(light.faces)


def test_no_speck_of_a_lighter_form_is_lit_from_behind(heavy):
    viewport, round_form = heavy.viewport, sphere(200_000, 50.0)
    viewport.set_mesh(round_form)
    heavy.settle()
    lighter = lightened(round_form.vertices, round_form.faces)
    light = Mesh(round_form.vertices[lighter.ids], lighter.faces)
    outward = light.vertices[light.faces].sum(axis=1)
    assert ((light.face_normals * outward).sum(axis=1) < 0).any(), "some triangles are turned over"
    for _ in range(4):
        viewport.turn_by(0.3, 0.1)
        viewport.repaint()
        assert viewport.scene.standing_in
        image = viewport.grabFramebuffer().convertToFormat(QImage.Format.Format_RGB32)
        rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
        grey = rows[..., :3].astype(float).mean(axis=2)
        middle = np.abs(grey - median_filter(grey, 5))[120:280, 120:280]
        assert middle.max() < 25


def test_a_heavy_form_drawn_in_pieces_is_the_form(heavy):
    viewport = heavy.viewport
    if not viewport.software:
        pytest.skip("a graphics card draws the form at once")
    shown = on_screen(heavy)
    viewport.scene.surface.actor.VisibilityOn()
    viewport.scene.stand_in.surface.actor.VisibilityOff()
    viewport.renderer.SetUseFXAA(True)
    viewport._only_show = False
    viewport.render_window.GetInteractor().EnableRenderOn()
    viewport.render_window.Render()
    viewport.render_window.GetInteractor().EnableRenderOff()
    viewport._only_show = True
    viewport.repaint()
    at_once = on_screen(heavy)
    viewport.scene.use_stand_in(True)
    inside = (slice(40, 360), slice(40, 380))  # not the cube
    different = np.abs(shown[inside].astype(int) - at_once[inside]).max(axis=2) > 8
    assert different.mean() < 0.01
    assert at_once[inside].std() > 10


def on_screen(stage) -> np.ndarray:
    """What the screen shows of the viewport, (h, w, 3), without another frame of it."""
    viewport = stage.viewport
    QTest.qWait(60)
    before = viewport.renders
    image = viewport.screen().grabWindow(viewport.window().winId()).toImage()
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    assert viewport.renders == before
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
    return rows[..., :3].copy()


def test_what_is_seen_of_a_heavy_form_is_known_before_anybody_asks(heavy, qtbot):
    viewport = heavy.viewport
    if not viewport.software:
        pytest.skip("a graphics card draws the form at once")
    qtbot.waitUntil(lambda: not viewport.sight_comes)
    ids = viewport.sight().ids
    actor = viewport.scene.surface.actor
    at_once = capture(viewport.render_window, viewport.renderer, actor)[::-1]
    assert (ids >= 0).mean() > 0.2
    assert (ids != at_once).mean() < 0.002  # where two triangles lie on one edge of a pixel


def test_a_stroke_ends_when_what_it_means_is_known(heavy, qtbot):
    viewport = heavy.viewport
    if not viewport.software:
        pytest.skip("a graphics card draws the form at once")
    viewport.turn_by(0.2, 0.0)
    told = []
    viewport.selecting.connect(told.append)
    heavy.mouse_drag(heavy.ellipse()[:6])
    assert heavy.kinds == ["press"] + ["move"] * 5
    assert told == [True]
    heavy.mouse(QEvent.Type.MouseMove, (30, 40))
    with qtbot.waitSignal(viewport.sighted):
        pass
    assert heavy.kinds == ["press"] + ["move"] * 5 + ["release"]
    assert told == [True, False]
    assert not viewport.sight_comes


def test_a_held_stroke_that_is_cancelled_never_ends(heavy, qtbot):
    viewport = heavy.viewport
    if not viewport.software:
        pytest.skip("a graphics card draws the form at once")
    viewport.turn_by(0.2, 0.0)
    heavy.mouse_drag(heavy.ellipse()[:6])
    viewport.cancel_pointer()
    with qtbot.waitSignal(viewport.sighted):
        pass
    assert "release" not in heavy.kinds


def test_the_region_of_a_heavy_form_is_never_lightened(heavy):
    viewport = heavy.viewport
    ids = viewport.vertices_inside(heavy.ellipse(0.15))
    viewport.set_region(ids)
    heavy.settle()
    viewport.set_vertices(viewport.vertices[ids] * 1.02, ids)
    viewport.repaint()
    assert viewport.scene.standing_in
    shown = viewport.scene.stand_in
    assert (shown.ids[-len(ids) :] == ids).all()
    moved = viewport.scene.surface.positions[ids]
    assert (shown.surface.positions[-len(ids) :] == moved).all()
    inside = np.isin(viewport.form.faces, ids).any(axis=1).sum()
    assert (shown.surface.faces >= shown.surface.n - len(ids)).any(axis=1).sum() == inside


def test_of_regions_marked_while_a_hand_moves_the_last_is_shown(heavy, monkeypatch):
    viewport, shown = heavy.viewport, []
    show = viewport.scene.set_region
    monkeypatch.setattr(
        viewport.scene, "set_region", lambda ids, *tint: (shown.append(ids), show(ids, *tint))
    )
    parts = [np.arange(0, count) for count in (500, 1000, 1500)]
    for ids in parts:
        viewport.set_region(ids)
    assert viewport.moving
    heavy.settle()
    assert len(shown) == 1
    assert shown[0] is parts[-1]
    clay = viewport.scene.surface.colours[-1].tolist()
    assert viewport.scene.surface.colours[0].tolist() != clay
    viewport.set_region(parts[-1].copy())
    heavy.settle()
    assert len(shown) == 1, "it is shown already"
    viewport.set_region(None)
    viewport.render_image((80, 60))
    assert shown[-1] is None, "a picture has the region asked for last"
    assert len(shown) == 2


def test_clustering_keeps_the_form_and_its_orientation():
    mesh = torus(60_000)
    lighter = lightened(mesh.vertices, mesh.faces, cells=60)
    ids, faces = lighter.ids, lighter.faces
    light = Mesh(mesh.vertices[ids], faces)
    assert light.n < 0.4 * mesh.n
    area = np.linalg.norm(mesh.face_normals, axis=1).sum()
    assert np.linalg.norm(light.face_normals, axis=1).sum() == pytest.approx(area, rel=0.1)
    assert ((light.vertex_normals * mesh.vertex_normals[ids]).sum(axis=1) > 0).mean() > 0.97
    some = np.flatnonzero(lighter.face >= 0)
    assert (np.sort(faces[lighter.face[some]]) == np.sort(lighter.cell[mesh.faces[some]])).all()


def test_a_part_kept_whole_leaves_no_gap_in_a_lighter_form():
    mesh = torus(60_000)
    lighter = lightened(mesh.vertices, mesh.faces, cells=60)
    kept = np.flatnonzero(mesh.vertices[:, 2] > 8.0)
    ids, faces = with_kept(lighter, mesh.faces, mesh.topology.incidence, kept)
    area = np.linalg.norm(mesh.face_normals, axis=1).sum()
    light = Mesh(mesh.vertices[ids], faces)
    assert np.linalg.norm(light.face_normals, axis=1).sum() == pytest.approx(area, rel=0.05)
    assert np.isin(kept, ids[faces]).all()


def test_the_parts_of_a_form_are_all_of_it_once():
    mesh = torus(60_000)
    parts = parts_of(mesh.vertices.astype(np.float32), mesh.faces, 10_000)
    assert len(parts) > 5
    of = np.concatenate([part.of for part in parts])
    assert (np.sort(of) == np.arange(len(mesh.faces))).all()
    again = np.concatenate([part.ids[part.faces] for part in parts])
    assert (again == mesh.faces[of]).all()


@pytest.mark.soak
def test_a_million_vertices_are_turned_and_lassoed(qtbot):
    mesh = sphere(1_000_000, 50.0)
    prepare(mesh)
    stage = Stage(mesh, (900, 700))
    viewport = stage.viewport
    qtbot.waitUntil(lambda: not viewport.sight_comes)
    viewport.turn_by(0.3, 0.1)
    if viewport.software:
        viewport.repaint()
        assert viewport.scene.standing_in
        assert viewport.scene.stand_in.surface.n < 0.1 * mesh.n
    qtbot.waitUntil(lambda: not viewport.moving and not viewport.sight_comes)
    chosen = viewport.vertices_inside(stage.ellipse(0.05, (0.0, 0.0)))
    toward = viewport.eye.toward(viewport.scene.placement.to_scene(mesh.vertices[chosen]))
    stage.close()
    assert 1000 < len(chosen) < 100_000
    assert ((mesh.vertices[chosen] / 50.0 * toward).sum(axis=1) > 0).all()


def test_what_was_prepared_of_a_form_is_taken_as_it_is(heavy):
    viewport, mesh = heavy.viewport, torus(90_000, bump=0.2)
    prepare(mesh)
    made = _own[mesh]
    viewport.set_mesh(mesh)
    surface = viewport.scene.surface
    assert surface.positions is made.positions
    assert surface.normals is made.normals
    assert viewport.vertices is made.vertices
    ids = np.arange(50)
    before = mesh.vertices[ids]
    viewport.set_vertices(before + 1.0, ids)
    viewport.set_mesh(mesh)
    assert (viewport.vertices == mesh.vertices).all(), "nothing was written into what is kept"
    assert (viewport.scene.surface.positions == placed(mesh).positions).all()
    assert (mesh.vertices[ids] == before).all()


def test_pieces_are_not_looked_through_while_only_the_camera_moves(heavy, monkeypatch):
    viewport = heavy.viewport
    if not viewport.software:
        pytest.skip("a graphics card draws the form at once")
    compared: list[int] = []

    def equal(one, other):
        compared.append(len(one))
        return (one == other).all()

    monkeypatch.setattr(pieces, "np", SimpleNamespace(array_equal=equal))
    viewport.turn_by(0.3, 0.1)
    heavy.settle()
    assert not compared
    ids = np.arange(50)
    viewport.set_vertices(viewport.form.vertices[ids] * 1.01, ids)
    heavy.settle()
    assert compared


def test_the_ghost_of_a_heavy_form_is_made_aside_and_is_the_same(heavy, monkeypatch):
    viewport, threads = heavy.viewport, set()
    ids = np.arange(400)
    apart = viewport.form.vertices[ids] + 2.0
    viewport.set_vertices(apart, ids)
    heavy.settle()
    make = viewport.scene.made_ghost

    def noted(*given):
        threads.add(threading.get_ident())
        return make(*given)

    monkeypatch.setattr(viewport.scene, "made_ghost", noted)
    viewport.ghost(viewport.form.vertices, ids)
    assert viewport.scene.ghost is None
    # The form moves on while it is made: what is shown is of the form as it is then.
    more = np.arange(500)
    viewport.set_vertices(viewport.form.vertices[more] + 2.0, more)
    heavy.settle()
    assert threading.get_ident() not in threads
    aside = viewport.scene.ghost
    assert aside is not None
    viewport.scene.take_ghost(make(viewport.form.vertices, more))
    at_once = viewport.scene.ghost
    assert (aside.positions == at_once.positions).all()
    assert (aside.faces == at_once.faces).all()
    assert (aside.normals == at_once.normals).all()
    assert (aside.colours == at_once.colours).all()


def test_the_tint_of_a_region_on_a_heavy_form_is_made_aside(heavy, monkeypatch):
    viewport, threads = heavy.viewport, set()
    make = viewport.scene.marked

    def noted(ids):
        threads.add(threading.get_ident())
        return make(ids)

    monkeypatch.setattr(viewport.scene, "marked", noted)
    ids = np.arange(1500)
    viewport.set_region(ids)
    heavy.settle()
    assert threads
    assert threading.get_ident() not in threads
    colours = viewport.scene.surface.colours.copy()
    lighter = viewport.scene.stand_in and viewport.scene.stand_in.surface.faces
    viewport.scene.set_region(None)
    viewport.scene.set_region(ids, make(ids))
    assert (viewport.scene.surface.colours == colours).all()
    if lighter is not None:
        assert (viewport.scene.stand_in.surface.faces == lighter).all()
