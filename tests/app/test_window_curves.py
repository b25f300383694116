"""Source and target in the window: pins, weights, the stabiliser, views, closed curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton

from app.look import PIN
from app.window import Window
from engine import Document
from tests.app.designing import (
    CTRL,
    ENDS,
    SHIFT,
    colours_near,
    draw,
    option,
    region,
    rest,
    seen,
    turned,
    typed,
)
from tests.app.driving import LEFT, NONE, Mouse, Pen, bow, bumpy_sphere, circle, picture

pytestmark = pytest.mark.window


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
    pen.pressure = 1.0
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
        typed(qtbot, window.edit.depth_hold, hold)
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


def test_a_lasso_over_the_outline_offers_the_back(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    roi = region(window, qtbot, radius=0.2)
    assert "Shift+L" not in window.hint.text, "in the middle nothing is left behind"
    qtbot.keyClick(view, Qt.Key.Key_L)
    view.standard_view("front", animate=False)
    rest(window, qtbot)
    pixels = view.view().project(session.document.mesh.vertices)
    x = (pixels[:, 0].max() - 6 - view.width() / 2) / view.height()
    roi = region(window, qtbot, x=x, radius=0.2)
    assert "Shift+L" in window.hint.text
    qtbot.keyClick(view, Qt.Key.Key_L, SHIFT)
    rest(window, qtbot)
    draft = session.document.draft
    assert set(roi) < set(draft.roi)
    assert len(draft.roi) > 1.7 * len(roi), "as much behind as before it"
    assert "Shift+L" not in window.hint.text


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
