"""Regions in the window: keys and names, the back, the plane of symmetry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtWidgets import QApplication

from app.window import Window
from engine import Recipe, mirrored_region, replay
from engine.arrays import I64
from plugins.registry import kinds
from tests.app.designing import (
    CTRL,
    SHIFT,
    by_palette,
    colours_near,
    draw,
    enter,
    option,
    region,
    rest,
    typed,
)
from tests.app.driving import LEFT, Mouse, bow, circle, picture

pytestmark = pytest.mark.window


def teeth(window: Window, roi: I64) -> float:
    """Border edges for the size of the region: a ragged border has more of them."""
    edges = window.session.document.mesh.topology.edges
    inside = np.isin(edges, roi)
    return float((inside.sum(axis=1) == 1).sum() / np.sqrt(len(roi)))


def test_the_region_is_changed_by_keys_and_by_name(window: Window, qtbot, artefacts: Path) -> None:
    session, view = window.session, window.viewport
    first = region(window, qtbot, radius=0.18)
    for key, larger in ((Qt.Key.Key_Equal, True), (Qt.Key.Key_Minus, False)):
        before = session.document.draft.roi
        qtbot.keyClick(view, key, CTRL)
        after = session.document.draft.roi
        assert set(before) < set(after) if larger else set(after) < set(before)
    assert len(np.setxor1d(session.document.draft.roi, first)) <= 2
    qtbot.keyClick(view, Qt.Key.Key_I, CTRL)
    assert len(session.document.draft.roi) > session.document.mesh.n / 2
    qtbot.keyClick(view, Qt.Key.Key_I, CTRL)
    rest(window, qtbot)

    # Triangles of the rim taken out one by one make it ragged; a word in the palette mends it.
    qtbot.keyClick(view, Qt.Key.Key_L)
    angle = np.linspace(0, 2 * np.pi, 400)
    radius = 0.2 * (1 + 0.12 * np.sign(np.sin(24 * angle)))
    ragged = np.array([view.width() / 2, view.height() / 2]) + view.height() * np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle)]
    )
    Mouse().stroke(window, ragged)
    rest(window, qtbot)
    picture(window, artefacts, "border ragged")
    rough = teeth(window, session.document.draft.roi)
    by_palette(window, qtbot, "smooth the border")
    rest(window, qtbot)
    picture(window, artefacts, "border smooth")
    assert teeth(window, session.document.draft.roi) < 0.9 * rough


def test_the_back_is_taken_by_the_lasso_or_later(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    normals = session.document.mesh.vertex_normals
    x = session.document.mesh.vertices
    eye = view.view()
    away = eye.depth(x + normals) > eye.depth(x)
    roi = region(window, qtbot)
    assert not away[roi].any(), "what is seen, and no more"
    qtbot.keyClick(view, Qt.Key.Key_L, SHIFT)
    rest(window, qtbot)
    later = np.asarray(session.document.draft.roi)
    assert set(roi) < set(later)
    assert 0.3 < away[later].mean() < 0.75
    qtbot.keyClick(view, Qt.Key.Key_L)
    qtbot.mouseClick(option(window, "through"), LEFT)
    through = region(window, qtbot)
    assert away[through].mean() > 0.3
    assert len(np.intersect1d(later, through)) > 0.9 * len(np.union1d(later, through))


def test_the_plane_of_symmetry_is_seen(window: Window, qtbot, artefacts: Path) -> None:
    session, view, scene = window.session, window.viewport, window.viewport.scene
    view.standard_view("front", animate=False)
    rest(window, qtbot)
    place = (view.width() / 2, view.height() * 0.4)
    plain = min(one.lightness() for one in colours_near(window, place))
    by_palette(window, qtbot, "mirror across x")
    rest(window, qtbot)
    assert scene.plane is not None
    assert scene.plane.sheet.GetVisibility(), "its two sides are being settled"
    picture(window, artefacts, "plane")
    assert min(one.lightness() for one in colours_near(window, place)) < plain - 40
    region(window, qtbot, x=0.14, radius=0.1)
    assert not scene.plane.sheet.GetVisibility(), "the line alone stays"
    assert scene.plane.line.GetVisibility()
    window.edit._more._head.click()
    at = QPointF(5, 5)
    box = window.edit.symmetry
    QApplication.sendEvent(box, QEnterEvent(at, at, QPointF(box.mapToGlobal(at.toPoint()))))
    assert scene.plane.sheet.GetVisibility()
    QApplication.sendEvent(box, QEvent(QEvent.Type.Leave))
    assert not scene.plane.sheet.GetVisibility()
    qtbot.keyClick(view, Qt.Key.Key_Y)
    assert scene.plane is None
    assert session.document.draft.options.mirror == ()


def test_a_region_chosen_while_the_plane_is_looked_for_is_on_both_sides(
    window: Window, qtbot
) -> None:
    session, view = window.session, window.viewport
    view.standard_view("front", animate=False)
    rest(window, qtbot)
    qtbot.keyClick(view, Qt.Key.Key_Y)
    assert session.jobs.busy("symmetry")
    Mouse().stroke(window, circle(view, 0.14, 0.0, 0.1))
    qtbot.waitUntil(lambda: not session.jobs.busy("symmetry"))
    rest(window, qtbot)
    draft = session.document.draft
    assert draft.options.mirror != ()
    both = mirrored_region(session.document.mesh, draft.roi, draft.options.mirror)
    assert len(both) == pytest.approx(len(draft.roi), rel=0.05)


def test_the_handle_is_mirrored(window: Window, qtbot, artefacts: Path) -> None:
    session, view = window.session, window.viewport
    view.standard_view("front", animate=False)
    by_palette(window, qtbot, "mirror across x")
    rest(window, qtbot)
    region(window, qtbot, x=0.13, radius=0.12)
    before = session.document.mesh.vertices
    qtbot.keyClick(view, Qt.Key.Key_H)
    typed(qtbot, option(window, "radius"), "24")
    draw(window, qtbot, bow(view, (0.13, 0.0), (0.19, -0.05)))
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    rest(window, qtbot)
    way = session.document.mesh.vertices - before
    side = before[:, 0] - before.mean(axis=0)[0]
    right, left = (way[mask] for mask in (side > 0, side < 0))
    # What is held goes as a whole: nothing goes farther.
    there, here = (one[np.linalg.norm(one, axis=1).argmax()] for one in (left, right))
    assert np.linalg.norm(here) > 2
    assert there == pytest.approx(here * [-1, 1, 1], abs=1e-6)
    picture(window, artefacts, "handle mirrored")
    recipe = Recipe.from_json(session.document.recipe.to_json(), kinds())
    again = replay(recipe, session.document.original)
    assert (again.vertices == session.document.mesh.vertices).all()


def test_a_curve_on_one_flank_reshapes_both(window: Window, qtbot, artefacts: Path) -> None:
    session, view = window.session, window.viewport
    qtbot.keyClick(view, Qt.Key.Key_1)
    rest(window, qtbot)
    by_palette(window, qtbot, "mirror across x")
    rest(window, qtbot)
    region(window, qtbot, x=0.13, radius=0.12)
    before = session.document.mesh.vertices
    ends = (0.13, -0.06), (0.13, 0.06)
    draw(window, qtbot, bow(view, *ends))
    draw(window, qtbot, bow(view, *ends, -0.4))
    assert len(session.document.draft.strokes) == 1, "one curve was drawn"
    picture(window, artefacts, "curve mirrored")
    enter(window, qtbot)
    way = session.document.mesh.vertices - before
    side = before[:, 0] - before.mean(axis=0)[0]
    right, left = (way[mask] for mask in (side > 1, side < -1))
    there, here = (np.linalg.norm(one, axis=1).max() for one in (left, right))
    assert here > 2
    assert there == pytest.approx(here, rel=0.1), "the other flank goes as far"
    out = np.sign(side) * way[:, 0]
    assert (out[np.abs(way).max(axis=1) > 1] > 0).mean() > 0.9, "and outwards as well"
    # The change is mirrored, not the mesh: what differs between the sides differs as before.
    assert (session.document.mesh.faces == session.document.original.faces).all()
    recipe = Recipe.from_json(session.document.recipe.to_json(), kinds())
    again = replay(recipe, session.document.original)
    assert (again.vertices == session.document.mesh.vertices).all()
