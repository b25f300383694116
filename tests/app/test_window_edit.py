"""Whole edits with real events in a rendered window, and what they leave behind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.window import Window
from engine import Recipe, load, replay, save
from plugins.registry import kinds
from tests.app.designing import curve, enter, region
from tests.app.driving import Mouse, Pen, bow, circle, picture, settled

HANDS = [pytest.param(Mouse(), id="mouse"), pytest.param(Pen(), id="pen")]


@pytest.mark.parametrize("hand", HANDS)
def test_a_whole_edit_at_two_levels_equals_its_replay(
    make_window, qtbot, sphere_file: Path, tmp_path: Path, artefacts: Path, hand: Mouse
) -> None:
    window = make_window()
    session = window.session
    window.files.open(sphere_file)
    qtbot.waitUntil(lambda: session.document is not None)
    first = session.document
    assert window.hint.text == "Circle the part you want to reshape"
    picture(window, artefacts, f"{hand.name} 1 open")

    region(window, qtbot, hand=hand)
    roi = session.document.draft.roi
    assert 200 < len(roi) < 1000
    base = session.shown.vertices
    assert (base[roi] != first.mesh.vertices[roi]).any(), "the base shape is shown"
    picture(window, artefacts, f"{hand.name} 2 base")

    curve(window, qtbot, -0.4, hand=hand)
    assert session.target_error < 0.5
    assert (session.shown.vertices != base).any(), "the surface follows the target"
    picture(window, artefacts, f"{hand.name} 3 target")
    enter(window, qtbot)
    picture(window, artefacts, f"{hand.name} 4 applied")
    assert session.shown is session.document.mesh, "the details are back"

    qtbot.waitUntil(
        lambda: session.decomposition is not None and session.decomposition.reaches(0.4),
    )
    window.level.slider.setValue(400)
    qtbot.waitUntil(settled(window))
    assert session.decomposition.mode_count(0.4) > 0
    curve(window, qtbot, 0.3, hand=hand)
    enter(window, qtbot)
    picture(window, artefacts, f"{hand.name} 5 second level")

    document = session.document
    assert [step.level for step in document.recipe.steps] == [0.0, 0.4]
    assert document.mesh.faces is first.mesh.faces
    outside = np.setdiff1d(np.arange(first.mesh.n), roi)
    assert (document.mesh.vertices[outside] == first.mesh.vertices[outside]).all()

    exported, recipe = tmp_path / "window.ply", tmp_path / "edit.json"
    window.files.export(exported)
    qtbot.waitUntil(lambda: not session.writing.busy)
    window.files.export_recipe(recipe)
    qtbot.waitUntil(recipe.exists)
    again = replay(Recipe.from_json(recipe.read_text("utf-8"), kinds()), load(sphere_file))
    save(again, tmp_path / "replay.ply")
    assert exported.read_bytes() == (tmp_path / "replay.ply").read_bytes()

    while session.history.can_undo:
        qtbot.keyClick(window.viewport, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert session.document is first
    qtbot.waitUntil(settled(window))
    assert session.shown is first.mesh
    assert (window.viewport.vertices == first.mesh.vertices).all()


def test_modes_stream_in_while_the_slider_lives(window: Window, qtbot) -> None:
    session = window.session
    seen: list[int] = []
    session.decomposition_changed.connect(lambda: seen.append(session.decomposition.k))
    region(window, qtbot)
    assert seen[0] == 0, "the base comes first"
    qtbot.waitUntil(lambda: session.decomposition.complete)
    assert seen == sorted(seen)
    window.level.slider.setValue(1000)
    assert (session.shown.vertices == session.document.mesh.vertices).all()
    assert window.level.modes.text().startswith("all")


def test_a_slide_of_the_level_is_one_moment(window: Window, qtbot) -> None:
    region(window, qtbot)
    session = window.session
    before = len(session.history.moments)
    for tick in (100, 200, 300):
        window.level.slider.setValue(tick)
    assert len(session.history.moments) == before + 1
    assert session.document.draft.level == 0.3
    qtbot.keyClick(window.viewport, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert session.document.draft.level == 0.0
    assert window.level.slider.value() == 0
    for key in (Qt.Key.Key_BracketRight, Qt.Key.Key_BracketRight, Qt.Key.Key_BracketLeft):
        qtbot.keyClick(window.viewport, key)
    assert session.document.draft.level == pytest.approx(0.02)


def test_escape_cancels_a_stroke_and_then_goes_back(window: Window, qtbot) -> None:
    session, mouse = window.session, Mouse()
    first = session.document
    mouse.stroke(window, circle(window.viewport, 0, 0, 0.2), release=False)
    assert window.toolhost.in_gesture
    qtbot.keyClick(window.viewport, Qt.Key.Key_Escape)
    assert not window.toolhost.in_gesture
    assert session.document is first
    mouse.send(window.viewport, "release", (10, 10), Qt.KeyboardModifier.NoModifier)
    assert session.document is first

    region(window, qtbot)
    curve(window, qtbot, -0.4)
    for left in ((1, True), (0, False)):
        qtbot.keyClick(window.viewport, Qt.Key.Key_Escape)
        draft = session.document.draft
        assert (int(draft.source is not None), draft.roi is not None) == (left[0], True)
    qtbot.keyClick(window.viewport, Qt.Key.Key_Escape)
    assert session.document.draft.roi is None
    assert session.document.mesh is first.mesh


def test_the_target_can_be_dragged_and_drawn_again(window: Window, qtbot) -> None:
    session, mouse = window.session, Mouse()
    region(window, qtbot)
    curve(window, qtbot, -0.4)
    before = session.document.draft.strokes[0]
    middle = len(before.target) // 2
    grasp, down = before.target[middle], np.array([0.0, 12.0])
    mouse.stroke(window, [grasp, grasp + down / 3, grasp + down])
    (dragged,) = session.document.draft.strokes
    assert dragged.target[middle] == pytest.approx(grasp + down, abs=0.5)
    assert dragged.target[[0, -1]] == pytest.approx(before.target[[0, -1]], abs=0.5)
    mouse.stroke(window, bow(window.viewport, (-0.12, -0.1), (0.12, -0.1)))
    (again,) = session.document.draft.strokes
    assert again.target[:, 1].mean() < dragged.target[:, 1].mean() - 10
    qtbot.waitUntil(settled(window))
    assert session.target_error < 0.5


def test_two_strokes_are_solved_together(window: Window, qtbot) -> None:
    session, mouse, view = window.session, Mouse(), window.viewport
    region(window, qtbot)
    curve(window, qtbot, -0.4)
    qtbot.keyClick(view, Qt.Key.Key_S)
    assert window.toolhost.active.id == "source"
    mouse.stroke(window, bow(view, (-0.1, 0.1), (0.1, 0.1)))
    mouse.stroke(window, bow(view, (-0.1, 0.1), (0.1, 0.1), 0.3))
    qtbot.waitUntil(settled(window))
    assert len(session.document.draft.strokes) == 2, session.problems.sentence
    assert session.target_error < 0.5


def test_an_error_is_one_sentence_and_the_document_stays(
    window: Window, qtbot, artefacts: Path
) -> None:
    session, mouse = window.session, Mouse()
    first = session.document
    window.toolbox.set_options("lasso", type(window.toolbox.options_of("lasso"))(through=True))
    mouse.stroke(window, circle(window.viewport, 0, 0, 0.49, n=90))
    qtbot.waitUntil(lambda: bool(session.problems.sentence))
    assert session.document is first
    assert "nothing is left that holds it" in window.hint.text
    qtbot.keyClick(window.viewport, Qt.Key.Key_Escape)
    assert "nothing is left" not in window.hint.text
    assert "Traceback" not in window.hint.text
    picture(window, artefacts, "error")
    window.toolbox.set_options("lasso", type(window.toolbox.options_of("lasso"))())
    region(window, qtbot)
    assert session.problems.sentence == ""
    mouse.stroke(window, [(4, 4), (30, 4), (60, 4)])
    assert "beside the form" in window.hint.text


def test_hold_b_shows_the_original(window: Window, qtbot) -> None:
    region(window, qtbot)
    session, view = window.session, window.viewport
    original = session.document.original.vertices
    assert (view.vertices != original).any()
    qtbot.keyPress(view, Qt.Key.Key_B)
    assert (view.vertices == original).all()
    qtbot.keyRelease(view, Qt.Key.Key_B)
    assert (view.vertices == session.shown.vertices).all()


def test_a_file_is_dropped_on_the_window(make_window, qtbot, sphere_file: Path) -> None:
    from PySide6.QtCore import QMimeData, QPointF, QUrl
    from PySide6.QtGui import QDropEvent

    window = make_window()
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(sphere_file))])
    event = QDropEvent(
        QPointF(300, 300),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.dropEvent(event)
    qtbot.waitUntil(lambda: window.session.document is not None)
    assert window.windowTitle().startswith("sphere.ply")
    from app.recent import recent

    assert recent() == [sphere_file.resolve()]


def test_a_file_that_cannot_be_read_is_said_and_nothing_changes(
    window: Window, qtbot, tmp_path: Path
) -> None:
    first = window.session.document
    broken = tmp_path / "broken.obj"
    broken.write_text("this is no mesh\n")
    window.files.open(broken)
    qtbot.waitUntil(lambda: bool(window.session.problems.sentence))
    assert "broken.obj" in window.hint.text
    assert window.session.document is first
