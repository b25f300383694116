"""Symmetry, strokes put aside, silhouettes, a lasso to adjust, morphing: in a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox, QPushButton, QToolButton

from app.panels.level import place_of
from app.window import Window
from engine.outlines import Outlines
from engine.silhouette import outline_edges
from tests.app.designing import curve, enter, option, region
from tests.app.driving import Mouse, circle, picture, settled


def choose(box: QComboBox, data: str) -> None:
    """Choose an entry by its arrow keys, as a person would."""
    QTest.keyClick(box, Qt.Key.Key_Home)
    for _ in range(box.findData(data)):
        QTest.keyClick(box, Qt.Key.Key_Down)


def test_the_plane_of_symmetry_is_chosen(make_window, sphere, qtbot, artefacts: Path) -> None:
    window = make_window(sphere, "dark")
    session, box = window.session, window.edit.symmetry
    window.edit._more._head.click()
    assert box.isVisible()
    choose(box, "x")
    assert window.symmetry.which == "x"
    middle = sphere.bounds.mean(axis=0)[0]
    assert session.document.draft.options.mirror == (1.0, 0.0, 0.0, middle)
    assert window.actions_table.qt["region.mirror.x"].isChecked()

    window.viewport.standard_view("front")
    qtbot.waitUntil(lambda: not window.viewport.moving)
    region(window, qtbot, x=-0.18, radius=0.1)
    roi = session.document.draft.roi
    x = sphere.vertices[roi, 0] - middle
    assert 0.4 < (x > 0).mean() < 0.6, "half of the region lies on either side"
    assert np.abs(x).min() > 2, "two parts apart from each other"
    picture(window, artefacts, "symmetry")

    window.actions_table.trigger("region.mirror.z")
    qtbot.waitUntil(settled(window))
    assert window.symmetry.which == "z"
    assert box.currentData() == "z"
    choose(box, "off")
    assert session.document.draft.options.mirror == ()


def test_form_and_detail_are_morphed_between_two_variants(
    make_window, sphere, qtbot, artefacts: Path
) -> None:
    window = make_window(sphere, "light", size=(1000, 640))
    session = window.session
    region(window, qtbot)
    curve(window, qtbot, sag=-0.4)
    enter(window, qtbot)
    edited = session.document
    window.compare_with(0)
    compare = window.compare
    qtbot.waitUntil(compare.isVisible)
    bar = compare.morph
    assert bar.isVisible()

    for _ in range(5):  # page by page, 10 each
        qtbot.keyClick(bar.form, Qt.Key.Key_PageUp)
    assert bar.shares == (0.5, 0.0)
    qtbot.waitUntil(lambda: session.shown.vertices is not edited.mesh.vertices)
    qtbot.waitUntil(settled(window))
    halfway = session.shown.vertices
    whole = np.abs(edited.mesh.vertices - sphere.vertices).max()
    assert 0.3 * whole < np.abs(halfway - sphere.vertices).max() < 0.7 * whole
    assert session.document is edited, "a preview changes nothing"
    bar.modes.setFocus()
    bar.modes.selectAll()
    qtbot.keyClicks(bar.modes, "60")
    qtbot.keyClick(bar.modes, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: (session.shown.vertices != halfway).any())
    qtbot.waitUntil(settled(window))
    halfway = session.shown.vertices
    picture(window, artefacts, "morph")

    keep = next(b for b in bar.findChildren(QPushButton) if b.text() == "Keep")
    qtbot.mouseClick(keep, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 2)
    qtbot.waitUntil(settled(window))
    assert session.document.recipe.steps[-1].title == "Morph"
    assert session.document.recipe.steps[-1].modes == 60, "what counts as form is kept with it"
    assert (session.document.mesh.vertices == halfway).all()
    assert bar.shares == (0.0, 0.0)

    qtbot.keyClick(bar.form, Qt.Key.Key_End)
    qtbot.keyClick(bar.detail, Qt.Key.Key_End)
    qtbot.waitUntil(lambda: (session.shown.vertices == sphere.vertices).all())
    window.end_compare()
    assert (session.shown.vertices == halfway).all(), "closing takes the preview away"


def button(window: Window, name: str) -> QToolButton:
    """Find a button of the Edit panel by what it says of itself."""
    QCoreApplication.processEvents()
    found = {one.accessibleName(): one for one in window.edit.findChildren(QToolButton)}
    return found[name]


def test_a_curve_is_put_aside_and_acts_again(make_window, sphere, qtbot, artefacts: Path) -> None:
    window = make_window(sphere, "dark")
    session = window.session
    region(window, qtbot, radius=0.25)
    curve(window, qtbot, sag=-0.3, height=-0.07)
    one = session.shown.vertices
    qtbot.keyClick(window.viewport, Qt.Key.Key_S)
    curve(window, qtbot, sag=0.3, height=0.07)
    both = session.shown.vertices
    assert (one != both).any()

    qtbot.mouseClick(button(window, "Put curve 2 aside"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(settled(window))
    assert len(session.document.draft.strokes) == 2
    assert (session.shown.vertices == one).all(), "as if it had not been drawn"
    QCoreApplication.processEvents()
    picture(window, artefacts, "eye")

    qtbot.mouseClick(button(window, "Let curve 2 act again"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(settled(window))
    assert (session.shown.vertices == both).all()

    qtbot.mouseClick(button(window, "Put curve 1 aside"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(settled(window))
    enter(window, qtbot)
    assert len(session.document.recipe.steps[0].strokes) == 1
    assert [stroke.hidden for stroke in session.document.draft.strokes] == [True]
    assert session.shown is session.document.mesh, "the details are back"
    assert window.toolhost.active.id == "source", "the flow goes on"


@pytest.mark.parametrize(
    ("how", "theme", "off"), [("option", "dark", 8), ("alt", "light", 8), ("by itself", "dark", -5)]
)
def test_a_stroke_along_the_outline_snaps_to_it(
    make_window, sphere, qtbot, artefacts: Path, monkeypatch, theme: str, how: str, off: int
) -> None:
    window = make_window(sphere, theme)
    session, view = window.session, window.viewport
    window.actions_table.trigger("view.front")
    qtbot.waitUntil(lambda: not view.moving)
    seen = view.view().project(sphere.vertices)
    middle, edge = seen.mean(axis=0), seen[seen[:, 0].argmax()]
    centre = (edge - [view.width() / 2, view.height() / 2]) / view.height()
    qtbot.mouseClick(option(window, "through"), Qt.MouseButton.LeftButton)
    region(window, qtbot, *centre, radius=0.2)
    roi = session.document.draft.roi

    # Along the outline of what is shown, eight pixels outside it over the background; or a little
    # inside, where the form is seen so edge-on that a tremor of the hand is a wide zigzag in depth.
    seen = view.view().project(session.shown.vertices)
    angle = np.linspace(-0.25, 0.25, 40)
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    radius = np.array([((seen - middle) @ one).max() for one in way])
    path = middle + (radius + off + 2 * np.sin(np.arange(40) * 1.7))[:, None] * way
    if how == "option":
        qtbot.mouseClick(option(window, "outline"), Qt.MouseButton.LeftButton)
    alt = Qt.KeyboardModifier.AltModifier
    Mouse().stroke(window, path, alt if how == "alt" else Qt.KeyboardModifier.NoModifier)
    source = session.document.draft.source
    assert source is not None, session.problems.sentence
    edges, outline, _ = outline_edges(session.shown, view.view(), roi)
    lines = view.view().project(session.shown.vertices)[edges[outline]].reshape(-1, 2)
    lies = view.view().project(session.shown.vertices[source.anchors])
    edge_px = np.linalg.norm(np.diff(lies, axis=0), axis=1).max()
    assert np.linalg.norm(lies[:, None] - lines, axis=2).min(axis=1).max() < edge_px / 2
    assert source.outline
    QCoreApplication.processEvents()
    picture(window, artefacts, f"outline {how} {theme}")

    Mouse().stroke(window, path + np.array([25, 0]))
    qtbot.waitUntil(settled(window))
    after = view.view().project(session.shown.vertices)
    assert after[:, 0].max() > seen[:, 0].max() + 10, "the outline bulges"
    assert session.document.draft.strokes[0].outline, "the outline meets the target"
    assert session.target_error < 0.5

    # While a hand drags it the outline is only brought near, here not at all, so that it would be
    # seen: what stays is what a replay gives.
    monkeypatch.setattr(Outlines, "nearer", lambda self, moved, level: (moved, 99.0))
    target = session.document.draft.strokes[0].target
    held, aside = target[len(target) // 2], np.array([12.0, 0.0])
    Mouse().stroke(window, [held, held + aside, held + 2 * aside])
    qtbot.waitUntil(settled(window))
    edit = session.document.draft.edit()
    assert edit.strokes[0].target is not target
    whole = edit.prepare(session.document.mesh).solve(edit.strokes)
    assert (session.shown.vertices == whole.level_vertices).all()
    assert session.target_error == whole.target_error_px

    # From elsewhere the anchors are on no outline: drawn again there, they meet the target.
    window.actions_table.trigger("view.back")
    qtbot.waitUntil(lambda: not view.moving)
    here = view.view().project(session.shown.vertices[source.anchors])
    Mouse().stroke(window, here + np.array([-20, 0]))
    assert not session.document.draft.strokes[0].outline


@pytest.mark.parametrize(("how", "theme"), [("enter", "dark"), ("double click", "light")])
def test_a_lasso_is_adjusted_before_it_is_taken(
    make_window, sphere, qtbot, artefacts: Path, how: str, theme: str
) -> None:
    window = make_window(sphere, theme)
    session, view, host = window.session, window.viewport, window.toolhost
    first = session.document
    qtbot.mouseClick(option(window, "adjust"), Qt.MouseButton.LeftButton)
    path = circle(view, 0, 0, 0.15)
    Mouse().stroke(window, path)
    assert host.in_gesture
    assert session.document is first, "nothing is taken yet"
    assert "Enter" in window.hint.text

    right = path[path[:, 0].argmax()]
    pull = right + np.linspace(0, 1, 12)[:, None] * [110, 0]
    Mouse().stroke(window, pull)
    assert session.document is first
    QCoreApplication.processEvents()
    picture(window, artefacts, f"lasso {theme}")

    if how == "enter":
        qtbot.keyClick(view, Qt.Key.Key_Return)
    else:
        qtbot.mouseDClick(view, Qt.MouseButton.LeftButton, pos=QPoint(view.width() // 2, 300))
    assert not host.in_gesture
    qtbot.waitUntil(settled(window))
    seen = view.view().project(sphere.vertices[session.document.draft.roi])
    assert seen[:, 0].max() > right[0] + 80, "what was pulled in is there"
    assert seen[:, 0].min() > path[:, 0].min() - 1, "the other side is as it was drawn"


def test_escape_drops_a_lasso_that_waits(window: Window, qtbot) -> None:
    first = window.session.document
    qtbot.mouseClick(option(window, "adjust"), Qt.MouseButton.LeftButton)
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.15))
    assert window.toolhost.in_gesture
    qtbot.keyClick(window.viewport, Qt.Key.Key_Escape)
    assert not window.toolhost.in_gesture
    assert window.session.document is first
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.15))
    Mouse().stroke(window, circle(window.viewport, 0.2, 0.1, 0.08))
    qtbot.keyClick(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(settled(window))
    seen = window.viewport.view().project(first.mesh.vertices[window.session.document.draft.roi])
    size = np.ptp(seen, axis=0) / window.viewport.height()
    assert (size < 0.17).all(), "the one drawn last counts"


def test_the_smallest_feature_is_slid(make_window, sphere, qtbot, artefacts: Path) -> None:
    window = make_window(sphere, "light")
    session, slider = window.session, window.level.feature_slider
    region(window, qtbot, radius=0.25)
    qtbot.waitUntil(lambda: session.decomposition.complete)
    known = session.decomposition
    assert slider.value() == 0
    counts = [0]
    for _ in range(5):
        qtbot.keyClick(slider, Qt.Key.Key_PageUp)
        counts.append(known.mode_count(session.document.draft.level))
    assert slider.value() == 500, "it stays where it was put"
    assert counts == sorted(counts)
    assert 1 < counts[-1] < known.m / 2
    # Half of the way: the geometric middle between the longest and the shortest.
    middle = np.sqrt(known.wavelength(1) * known.wavelength(known.m))
    assert middle <= window.level.feature.value() + 0.01 < 1.5 * middle
    QCoreApplication.processEvents()
    picture(window, artefacts, "feature")

    window.level.slider.setValue(0)
    assert slider.value() == 0, "it follows the level"
    qtbot.keyClick(slider, Qt.Key.Key_End)
    assert session.document.draft.level == 1.0
    window.level.percent.setValue(60.0)
    k = known.mode_count(session.document.draft.level)
    assert abs(slider.value() / 1000 - place_of(known, k)) < 0.002
