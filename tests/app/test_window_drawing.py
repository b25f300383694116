"""Region, level, source and target, each line of them with real events in a rendered window."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QEnterEvent, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton, QWidget

from app.look import PIN
from app.window import Window
from engine import Document, Recipe, mirrored_region, replay
from engine.arrays import F64, I64
from plugins.feature import missing_at
from plugins.registry import kinds
from tests.app.driving import LEFT, NONE, Mouse, Pen, bow, bumpy_sphere, circle, picture, settled

pytestmark = pytest.mark.window

CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier
ENDS = (-0.12, 0.0), (0.12, 0.0)


def rest(window: Window, qtbot) -> None:
    qtbot.waitUntil(
        lambda: settled(window)() and not window.viewport.moving,
        timeout=30_000,
    )


def region(window: Window, qtbot, x: float = 0.0, y: float = 0.0, radius: float = 0.22) -> I64:
    Mouse().stroke(window, circle(window.viewport, x, y, radius))
    rest(window, qtbot)
    return np.asarray(window.session.document.draft.roi)


def modes(window: Window, qtbot) -> None:
    known = lambda: window.session.decomposition  # noqa: E731
    qtbot.waitUntil(lambda: known() is not None and known().complete, timeout=60_000)


def draw(window: Window, qtbot, *paths: F64, hand: Mouse | None = None) -> None:
    for path in paths:
        (hand or Mouse()).stroke(window, path)
    rest(window, qtbot)


def enter(window: Window, qtbot) -> None:
    steps = len(window.session.document.recipe.steps)
    qtbot.keyClick(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == steps + 1, timeout=30_000)
    rest(window, qtbot)


def option(window: Window, name: str) -> QWidget:
    """The control of an option of the tool in hand."""
    QApplication.processEvents()
    found = window.strip.findChildren(QWidget, f"option {name}")
    return next(one for one in found if one.isVisible())


def typed(qtbot, field: QWidget, text: str) -> None:
    """Type a number into a field in place of what it holds, and take it."""
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, text)
    qtbot.keyClick(field, Qt.Key.Key_Return)


def by_palette(window: Window, qtbot, words: str) -> None:
    """Find a command by typing, and do it."""
    qtbot.keyClick(window.viewport, Qt.Key.Key_P, CTRL | SHIFT)
    qtbot.waitUntil(window.palette_box.isVisible)
    qtbot.keyClicks(window.palette_box.line, words)
    qtbot.keyClick(window.palette_box.line, Qt.Key.Key_Return)


def turned(window: Window, qtbot, dx: float) -> None:
    """Turn the view by a drag with the middle button."""
    view = window.viewport
    at = QPoint(view.width() // 2, view.height() // 2)
    middle = Qt.MouseButton.MiddleButton
    QTest.mousePress(view, middle, NONE, at)
    for share in (0.5, 1.0):
        QTest.mouseMove(view, at + QPoint(round(share * dx), 0))
    QTest.mouseRelease(view, middle, NONE, at + QPoint(round(dx), 0))
    rest(window, qtbot)


def seen(window: Window, ids: int | I64) -> F64:
    """Where vertices of the form as it is shown are seen, (p, 2) px."""
    at = np.atleast_1d(ids)
    return np.asarray(window.viewport.view().project(window.session.shown.vertices[at]))


def colours_near(window: Window, at: Sequence[float], reach: int = 4) -> list[QColor]:
    """Colours of the pixels about a place of the form's picture."""
    window.viewport.repaint()
    image = window.viewport.grab().toImage()
    ratio = image.devicePixelRatio()
    x, y = (round(float(v) * ratio) for v in at)
    way = range(-reach, reach + 1)
    return [image.pixelColor(x + i, y + j) for i in way for j in way]


# ---- region


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
    qtbot.waitUntil(lambda: not session.jobs.busy("symmetry"), timeout=30_000)
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
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1, timeout=30_000)
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


# ---- level


def test_without_a_region_the_level_leaves_its_room_to_the_steps(
    make_window, sphere, qtbot
) -> None:
    window = make_window(sphere, size=(1180, 800))
    level, bar = window.level, window.body.side.verticalScrollBar()
    assert not level.histogram.isVisible()
    assert not window.edit.amount.isEnabled()
    tall = window.steps.tree.height()
    region(window, qtbot)
    assert level.histogram.isVisible()
    assert level.curve.isVisible()
    QApplication.processEvents()
    assert window.steps.tree.height() < tall
    assert bar.maximum() == 0, "all three panels are in sight"
    rows = window.steps.tree
    last = rows.visualItemRect(rows.topLevelItem(rows.topLevelItemCount() - 1))
    assert last.bottom() <= rows.viewport().height(), "what was done last is in sight"


def test_a_press_on_the_curve_takes_that_many_modes(window: Window, qtbot) -> None:
    session, level = window.session, window.level
    region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    qtbot.waitUntil(lambda: len(level.curve._counts) > 0)
    base = session.shown.vertices
    for share in (0.6, 0.1):
        x = round(8.5 + share * (level.curve.width() - 17))
        qtbot.mouseClick(level.curve, LEFT, NONE, QPoint(x, 20))
        k = known.mode_count(session.document.draft.level)
        assert k == pytest.approx(share * known.k, abs=0.01 * known.k + 2)
        assert level.modes.text().startswith(f"{k:,} of")
    assert (session.shown.vertices != base).any(), "the form follows"
    qtbot.waitUntil(lambda: level.histogram.cutoff == pytest.approx(known.cutoff(k)))
    assert window.viewport.scene._ghost is not None, "the original is seen where it differs"


def test_a_click_on_a_bump_sets_the_level_below_it(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    roi = region(window, qtbot)
    modes(window, qtbot)
    known = session.decomposition
    # The vertex of the region that stands farthest off the base, away from the rim.
    height = np.linalg.norm(known.original - known.base, axis=1)
    at = seen(window, known.roi)
    middle = np.array([view.width() / 2, view.height() / 2])
    height[np.linalg.norm(at - middle, axis=1) > 0.12 * view.height()] = 0
    bump = int(height.argmax())
    qtbot.keyClick(view, Qt.Key.Key_E)
    assert window.toolhost.active.id == "feature"
    qtbot.mouseClick(view, LEFT, NONE, QPoint(*at[bump].round().astype(int)))
    rest(window, qtbot)
    level = session.document.draft.level
    k = known.mode_count(level)
    assert 0 < k < known.k
    near = np.append(session.document.mesh.topology.adjacency[[roi[bump]]].indices, roi[bump])
    gone = missing_at(known, np.flatnonzero(np.isin(known.roi, near)))
    assert gone[k] > 0.5 * gone[0], "the bump is gone"
    assert gone[min(4 * k, known.k)] < gone[k], "and comes with finer detail"
    assert window.toolhost.active.id == "source", "the flow goes on"


def test_a_mode_swings_at_a_click(window: Window, qtbot, artefacts: Path) -> None:
    level, view = window.level, window.viewport
    roi = region(window, qtbot)
    modes(window, qtbot)
    qtbot.mouseClick(level.modes_button, LEFT)
    typed(qtbot, level.mode, "4")
    assert window.modes.playing
    assert "building block" in window.hint.text
    base = window.session.decomposition.base
    heard: list[float] = []

    def both_ways() -> bool:
        way = view.vertices[roi] - base
        heard.append(float((way * window.session.document.mesh.vertex_normals[roi]).sum()))
        return min(heard) < 0 < max(heard)

    qtbot.waitUntil(both_ways, timeout=10_000)
    qtbot.mouseClick(level.play, LEFT)
    still = view.vertices.copy()
    QApplication.processEvents()
    assert (view.vertices == still).all()
    picture(window, artefacts, "mode 4")
    qtbot.mouseClick(level.modes_button, LEFT)
    assert window.modes.mode is None
    assert (view.vertices == window.session.shown.vertices).all()
    assert "draw a curve" in window.hint.text


# ---- source and target


def test_pins_are_set_dragged_and_taken_out(window: Window, qtbot, artefacts: Path) -> None:
    session, view = window.session, window.viewport
    roi = region(window, qtbot)
    qtbot.keyClick(view, Qt.Key.Key_N)
    middle = QPoint(view.width() // 2, view.height() // 2)
    qtbot.mouseClick(view, LEFT, NONE, middle + QPoint(0, 60))
    rest(window, qtbot)
    (pin,) = session.document.draft.options.pins
    assert pin in roi
    picture(window, artefacts, "pin")
    blue = QColor(PIN)
    shades = colours_near(window, seen(window, pin)[0], 3)
    assert any(abs(one.hue() - blue.hue()) < 15 and one.saturation() > 60 for one in shades)

    start = seen(window, pin)[0]
    draw(window, qtbot, start + np.linspace(0, 1, 8)[:, None] * [40.0, -20.0])
    (moved,) = session.document.draft.options.pins
    assert moved != pin
    assert seen(window, moved)[0] == pytest.approx(start + np.array([40, -20]), abs=14)
    assert "1 pin" in [line.name for line in listed(window)]

    held = session.shown.vertices[moved].copy()
    qtbot.keyClick(view, Qt.Key.Key_S)
    draw(window, qtbot, bow(view, *ENDS), bow(view, *ENDS, -0.3))
    assert session.shown.vertices[moved] == pytest.approx(held, abs=1e-6), "it holds"
    qtbot.keyClick(view, Qt.Key.Key_N)
    qtbot.mouseClick(view, LEFT, NONE, QPoint(*seen(window, moved)[0].round().astype(int)))
    rest(window, qtbot)
    assert session.document.draft.options.pins == ()
    assert np.linalg.norm(session.shown.vertices[moved] - held) > 0.1, "and lets go"


def listed(window: Window) -> list:
    """The lines of the Edit panel."""
    return list(window.edit._listed[1:])


def test_a_light_pen_holds_less(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    qtbot.mouseClick(option(window, "weights"), LEFT)
    pen = Pen()
    path = bow(view, *ENDS)
    pen.send(view, "press", path[0], NONE)
    for i, at in enumerate(path[1:]):
        pen.pressure = 1.0 if i < len(path) / 2 else 0.08
        pen.send(view, "move", at, NONE)
    pen.send(view, "release", path[-1], NONE)
    source = session.document.draft.source
    across = seen(window, source.anchors)[:, 0]
    firm, light = (
        source.weights[across < view.width() / 2 - 20],
        source.weights[across > view.width() / 2 + 20],
    )
    assert firm.min() > 0.9
    assert light.max() < 0.2
    draw(window, qtbot, bow(view, *ENDS, -0.35), hand=pen)
    (stroke,) = session.document.draft.strokes
    off = np.linalg.norm(seen(window, stroke.anchors) - stroke.target, axis=1)
    order = np.argsort(across)
    half = len(order) // 2
    assert off[order[half:]].mean() > 3 * off[order[:half]].mean()


def test_the_stabiliser_takes_the_tremor_out(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    draw(window, qtbot, bow(view, *ENDS))
    steady = bow(view, *ENDS, -0.3, n=24)
    tremor = steady + 12 * np.column_stack([np.zeros(24), np.sin(0.65 * np.arange(24))])
    targets = []
    for path, amount in ((steady, "0"), (tremor, "0"), (tremor, "20")):
        typed(qtbot, option(window, "stabiliser"), amount)
        draw(window, qtbot, path)
        (stroke,) = session.document.draft.strokes
        targets.append(stroke.target[2:-2])
        qtbot.keyClick(view, Qt.Key.Key_Z, CTRL)
        rest(window, qtbot)
    shaken, calm = (np.abs(one - targets[0]).mean() for one in targets[1:])
    assert shaken > 1
    assert calm < 0.75 * shaken, "the anchors themselves take some of it out"


def test_strokes_from_several_views_hold_together(window: Window, qtbot, artefacts: Path) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot, radius=0.3)
    draw(window, qtbot, bow(view, (-0.1, -0.06), (0.1, -0.06)))
    draw(window, qtbot, bow(view, (-0.1, -0.06), (0.1, -0.06), -0.25))
    qtbot.keyClick(view, Qt.Key.Key_S)
    turned(window, qtbot, 60)
    draw(window, qtbot, bow(view, (-0.06, 0.1), (0.08, 0.1)))
    assert session.document.draft.source is not None, session.problems.sentence
    draw(window, qtbot, bow(view, (-0.06, 0.1), (0.08, 0.1), 0.25))
    one, other = session.document.draft.strokes
    assert np.abs(one.view.matrix - other.view.matrix).max() > 0.05
    for stroke in (one, other):
        off = stroke.view.project(session.shown.vertices[stroke.anchors]) - stroke.target
        assert np.linalg.norm(off, axis=1).max() < 1.0
    assert session.target_error < 1.0
    picture(window, artefacts, "two views")


def test_depth_hold_keeps_the_distance_from_the_eye(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    window.edit._more._head.click()
    draw(window, qtbot, bow(view, *ENDS))
    anchors = session.document.draft.source.anchors
    at_rest = view.view().depth(session.shown.vertices[anchors])
    draw(window, qtbot, bow(view, *ENDS, -0.4))
    away = []
    for hold in ("0", "10"):
        typed(qtbot, window.edit.depth, hold)
        rest(window, qtbot)
        assert session.target_error < 1.0
        depth = view.view().depth(session.shown.vertices[anchors])
        away.append(float(np.abs(depth - at_rest).mean()))
    assert away[1] < 0.5 * away[0]


def test_a_curve_that_ends_where_it_began_is_closed(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot, radius=0.3)
    draw(window, qtbot, circle(view, 0, 0, 0.1), circle(view, 0, 0, 0.13))
    (stroke,) = session.document.draft.strokes
    assert stroke.closed
    assert session.target_error < 1.0
    assert "closed" in listed(window)[0].words
    off = np.linalg.norm(seen(window, stroke.anchors) - circle(view, 0, 0, 0)[0], axis=1)
    ring = stroke.target - circle(view, 0, 0, 0)[0]
    gaps = np.diff(np.sort(np.arctan2(ring[:, 1], ring[:, 0])))
    assert gaps.max() < 0.6, "all the way round"
    assert off == pytest.approx(np.full(len(off), 0.13 * view.height()), rel=0.2)


def test_a_curve_on_the_outline_asks_for_the_back(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    view.standard_view("front", animate=False)
    rest(window, qtbot)
    mesh = session.document.mesh
    pixels = view.view().project(mesh.vertices)
    x = (pixels[:, 0].max() - 6 - view.width() / 2) / view.height()
    roi = region(window, qtbot, x=x, radius=0.2)
    down = bow(view, (x, -0.08), (x, 0.08), -0.05)
    Mouse().stroke(window, down, Qt.KeyboardModifier.AltModifier)
    rest(window, qtbot)
    source = session.document.draft.source
    assert source is not None
    assert "Shift+L" in window.hint.text
    qtbot.keyClick(view, Qt.Key.Key_L, SHIFT)
    rest(window, qtbot)
    draft = session.document.draft
    assert set(roi) < set(draft.roi)
    assert draft.source is source, "the curve stays"
    assert window.toolhost.active.id == "target"
    draw(window, qtbot, down + np.array([20, 0]))
    assert session.target_error < 1.0


def test_what_was_said_of_a_stroke_goes_with_the_next(window: Window, qtbot) -> None:
    region(window, qtbot, radius=0.1)
    draw(window, qtbot, bow(window.viewport, (-0.05, 0.0), (0.18, 0.0)))
    assert "Only" in window.hint.text
    draw(window, qtbot, bow(window.viewport, (-0.05, 0.0), (0.05, 0.0), 0.2))
    assert "Only" not in window.hint.text


def test_curves_go_with_the_form_that_they_were_drawn_on(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    region(window, qtbot)
    draw(window, qtbot, bow(view, *ENDS), bow(view, *ENDS, 0.3))
    assert view.overlay.curve("target 0") is not None
    session.start(Document.open(bumpy_sphere(800)))
    rest(window, qtbot)
    assert view.overlay.curve("target 0") is None


# ---- edit tools and the rail


@pytest.mark.parametrize(
    ("tool", "field", "value"),
    [
        ("smooth", "amount", "1"),
        ("equaliser", "small", "3"),
        ("inflate", "distance", "6"),
        ("remesh", "density", "0.5"),
    ],
)
def test_a_tool_is_set_seen_and_kept(
    window: Window, qtbot, artefacts: Path, tool: str, field: str, value: str
) -> None:
    session = window.session
    roi = region(window, qtbot)
    before = session.document.mesh
    qtbot.mouseClick(window.rail.buttons[tool], LEFT)
    assert window.toolhost.active.id == tool
    typed(qtbot, option(window, field), value)
    rest(window, qtbot)
    if tool != "remesh":
        qtbot.waitUntil(lambda: (session.shown.vertices[roi] != before.vertices[roi]).any())
        assert session.document.mesh is before, "a preview changes nothing"
    picture(window, artefacts, f"tool {tool}")
    enter(window, qtbot)
    after = session.document.mesh
    (step,) = session.document.recipe.steps
    assert step.kind == tool
    if tool == "inflate":
        way = np.linalg.norm(after.vertices - before.vertices, axis=1).max()
        assert way == pytest.approx(6, rel=0.05)
    elif tool == "remesh":
        assert after.n < before.n
    recipe = Recipe.from_json(session.document.recipe.to_json(), kinds())
    again = replay(recipe, session.document.original)
    assert (again.vertices == after.vertices).all()


def test_the_rail_says_the_keys_that_work(window: Window) -> None:
    actions, rail = window.actions_table, window.rail
    assert "(L)" in rail.buttons["lasso"].toolTip()
    actions.remap("tool.lasso", ("Ctrl+Alt+L",))
    assert f"({QKeySequence('Ctrl+Alt+L').toString()})" in rail.buttons["lasso"].toolTip()
    actions.remap("tool.lasso", ())
    assert "(" not in rail.buttons["lasso"].toolTip().partition("<br>")[0]
    actions.remap("tool.lasso", None)


def test_a_press_on_the_bin_is_not_lost(window: Window, qtbot) -> None:
    """What goes on in the background does not take the buttons away under the pointer."""
    session = window.session
    region(window, qtbot)
    draw(window, qtbot, bow(window.viewport, *ENDS), bow(window.viewport, *ENDS, -0.3))
    QApplication.processEvents()
    bins = window.edit.findChildren(QToolButton)
    bin_ = next(one for one in bins if one.accessibleName() == "Remove curve 1")
    QTest.mousePress(bin_, LEFT)
    session.busy_changed.emit()
    session.decomposition_changed.emit()
    QApplication.processEvents()
    QTest.mouseRelease(bin_, LEFT)
    assert session.document.draft.strokes == ()
