"""The window around the flow: first minute, regions, variants, palette, keys, looks, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QSettings, Qt
from PySide6.QtGui import QKeySequence

from app.palette import match
from app.panels.steps import rows
from app.plate import Plate
from app.welcome import DONE, belly
from app.window import Window
from engine import History, Mesh
from tests.app.driving import Mouse, Pen, bow, circle, picture, settled, soon

CONTROL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


def lasso(window: Window, qtbot, radius: float = 0.2, **keys) -> None:
    Mouse().stroke(window, circle(window.viewport, 0, 0, radius), **keys)
    qtbot.waitUntil(settled(window))


def sketch(window: Window, qtbot, sag: float = -0.4) -> None:
    view, steps = window.viewport, len(window.session.document.recipe.steps)
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0)))
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0), sag))
    qtbot.waitUntil(settled(window))
    qtbot.keyClick(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == steps + 1)
    qtbot.waitUntil(settled(window))


def test_the_first_minute_is_ticked_off_and_never_comes_again(
    make_window, qtbot, sphere: Mesh, artefacts: Path
) -> None:
    window = make_window(sphere)
    window.welcome.begin()
    assert window.welcome.isVisible()
    assert window.viewport.overlay._invitation is not None
    picture(window, artefacts, "welcome")
    lasso(window, qtbot)
    assert window.viewport.overlay._invitation is None
    assert window.welcome.reached == 1
    sketch(window, qtbot)
    assert not window.welcome.isVisible()
    assert "on the right" in window.hint.text
    assert QSettings().value(DONE, False, type=bool)
    window.welcome.begin()
    assert not window.welcome.isVisible()


def test_the_invitation_lies_around_the_widest_part() -> None:
    t = np.linspace(0, 1, 400)
    wide = np.where((t > 0.4) & (t < 0.6), 100, 20)
    seen = np.concatenate([np.column_stack([300 + s * wide, 600 * t]) for s in (-1, 1)])
    path = belly(seen)
    assert path[:, 0].mean() == pytest.approx(300, abs=1)
    assert 230 < path[:, 1].mean() < 370
    assert np.ptp(path[:, 0]) < 200


def test_shift_adds_control_takes_and_the_eraser_end_takes(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    lasso(window, qtbot, 0.15)
    first = session.document.draft.roi
    qtbot.keyClick(view, Qt.Key.Key_L)
    Mouse().stroke(window, circle(view, 0.15, 0, 0.1), SHIFT)
    grown = session.document.draft.roi
    assert set(first) < set(grown)
    for hand, keys in ((Mouse(), CONTROL), (Pen(eraser=True), Qt.KeyboardModifier.NoModifier)):
        before = session.document.draft.roi
        qtbot.keyClick(view, Qt.Key.Key_L)
        hand.stroke(window, circle(view, 0.15, 0, 0.08), keys)
        assert set(session.document.draft.roi) < set(before) or hand.name == "pen"
    qtbot.waitUntil(settled(window))


def test_the_brush_stays_in_hand_and_s_goes_on(window: Window, qtbot, artefacts: Path) -> None:
    view = window.viewport
    qtbot.keyClick(view, Qt.Key.Key_P)
    for y in (0.0, 0.06):
        Mouse().stroke(window, bow(view, (-0.15, y), (0.15, y)))
        qtbot.waitUntil(settled(window))
        assert window.toolhost.active.id == "brush"
    picture(window, artefacts, "brush")
    qtbot.keyClick(view, Qt.Key.Key_S)
    assert window.toolhost.active.id == "source"


def test_regions_grow_shrink_invert_and_are_kept(window: Window, qtbot) -> None:
    session, actions = window.session, window.actions_table
    lasso(window, qtbot)
    roi = session.document.draft.roi
    actions.trigger("region.grow")
    assert set(roi) < set(session.document.draft.roi)
    actions.trigger("region.shrink")
    actions.trigger("region.keep")
    assert window.ask.isVisible()
    qtbot.keyClicks(window.ask.line, "Belly")
    qtbot.keyClick(window.ask.line, Qt.Key.Key_Return)
    assert list(session.document.regions) == ["Belly"]
    kept = session.document.regions["Belly"]
    actions.trigger("region.invert")
    assert len(session.document.draft.roi) == session.document.mesh.n - len(kept)
    session.choose_region(kept, "Belly")
    assert (session.document.draft.roi == kept).all()
    qtbot.waitUntil(settled(window))


def test_a_symmetric_region_is_on_both_sides(window: Window, qtbot) -> None:
    session = window.session
    window.actions_table.trigger("region.symmetry")
    qtbot.waitUntil(lambda: bool(session.document.draft.options.mirror))
    plane = np.array(session.document.draft.options.mirror)
    lasso(window, qtbot, 0.12)
    x = session.document.mesh.vertices[session.document.draft.roi]
    side = x @ plane[:3] - plane[3]
    assert abs((side > 0).mean() - 0.5) < 0.1


def test_variants_are_a_tree_with_thumbnails_and_names(
    window: Window, qtbot, artefacts: Path
) -> None:
    session, steps = window.session, window.steps
    qtbot.waitUntil(lambda: 0 in steps.pictures())
    lasso(window, qtbot)
    sketch(window, qtbot)
    first = session.history.current_id
    qtbot.waitUntil(lambda: first in steps.pictures())
    before = session.document.mesh
    session.undo()
    assert session.document.draft.strokes, "undo brings the curves back"
    session.go(0)
    lasso(window, qtbot, 0.16)
    sketch(window, qtbot, 0.4)
    second = session.history.current_id
    qtbot.waitUntil(lambda: second in steps.pictures())
    assert all(data.startswith(b"\x89PNG") for data in steps.pictures().values())
    root = steps.tree.topLevelItem(0)
    assert root.childCount() == 2, "two ways from the opened mesh"
    session.rename(second, "Slim")
    assert "Slim" in [row.words for row in rows(session.history)]
    picture(window, artefacts, "variants")
    session.go(first)
    assert session.document.mesh is before
    qtbot.waitUntil(settled(window))


def test_a_chain_of_steps_does_not_indent(sphere: Mesh) -> None:
    from engine import Document, SketchEdit

    history = History(Document.open(sphere))
    step = SketchEdit(np.array([1]), 0.0, ())
    for _ in range(3):
        history.add(history.current.with_step(step, sphere), "Sketch")
    history.add(history.current.with_draft(history.current.draft.with_roi(None)), "Region")
    assert [row.words for row in rows(history)] == ["Opened", *["Sketch"] * 3, "Region"]


def test_the_palette_finds_and_does(window: Window, qtbot, artefacts: Path) -> None:
    view = window.viewport
    qtbot.keyClick(view, Qt.Key.Key_P, CONTROL | SHIFT)
    palette = window.palette_box
    qtbot.waitUntil(palette.isVisible)
    qtbot.keyClicks(palette.line, "wiref")
    palette.grab().save(str(artefacts / "palette.png"))
    assert palette.list.topLevelItem(0).text(0) == "View: Wireframe"
    qtbot.keyClick(palette.line, Qt.Key.Key_Return)
    assert not palette.isVisible()
    assert view.wireframe
    assert match("wf", "view wireframe") is not None
    assert match("zq", "view wireframe") is None
    assert match("wire", "view wireframe") < match("wf", "view wireframe")


def test_every_action_has_its_own_keys_and_they_can_be_changed(window: Window, qtbot) -> None:
    actions = window.actions_table
    taken: dict[str, str] = {}
    for name in actions.table:
        for keys in actions.keys(name):
            text = QKeySequence(keys).toString()
            assert text, f"{name} has unreadable keys {keys!r}"
            assert text not in taken, f"{text} does both {taken.get(text)} and {name}"
            taken[text] = name
    window.show_keys()
    keys = window._keys
    keys.choose("view.wireframe")
    keys.edit.setKeySequence(QKeySequence("Ctrl+Alt+W"))
    keys.edit.editingFinished.emit()
    assert actions.keys("view.wireframe") == ("Ctrl+Alt+W",)
    keys.close()
    qtbot.keyClick(window.viewport, Qt.Key.Key_W, CONTROL | Qt.KeyboardModifier.AltModifier)
    assert window.viewport.wireframe
    actions.remap("view.wireframe", None)
    assert actions.keys("view.wireframe") == ("W",)


def test_tab_hides_the_panels(window: Window, qtbot) -> None:
    wide = window.viewport.width()
    qtbot.keyClick(window.viewport, Qt.Key.Key_Tab)
    assert not window.body.side.isVisible()
    qtbot.waitUntil(lambda: window.viewport.width() > wide)
    qtbot.keyClick(window.viewport, Qt.Key.Key_Tab)
    assert window.body.side.isVisible()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_both_themes_show_every_state(
    make_window, qtbot, sphere: Mesh, artefacts: Path, theme: str
) -> None:
    window = make_window(sphere, theme=theme, size=(1000, 700))
    picture(window, artefacts, f"{theme} open")
    lasso(window, qtbot)
    picture(window, artefacts, f"{theme} region")
    sketch(window, qtbot)
    picture(window, artefacts, f"{theme} applied")
    dark = window.palette().window().color().lightnessF() < 0.5
    assert dark == (theme == "dark")


def test_a_smallest_feature_typed_sets_the_level(window: Window, qtbot) -> None:
    lasso(window, qtbot)
    session = window.session
    qtbot.waitUntil(lambda: session.decomposition.complete)
    field = window.level.feature
    field.setFocus()
    field.lineEdit().selectAll()
    qtbot.keyClicks(field, "20")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    known = session.decomposition
    k = known.mode_count(session.document.draft.level)
    assert known.wavelength(k) == pytest.approx(20, rel=0.2)
    assert known.wavelength(k) >= 20
    qtbot.waitUntil(lambda: window.level.histogram.cutoff is not None)


def test_a_plate_says_and_asks(window: Window, qtbot) -> None:
    plate: Plate = window.plate
    asked: list[str] = []
    plate.say("Opened", ["one", "two"], {"Again": lambda: asked.append("again")})
    assert "two" in plate.text
    qtbot.mouseClick(plate.buttons["Again"], Qt.MouseButton.LeftButton)
    assert asked == ["again"]
    assert not plate.isVisible()


def test_two_variants_are_seen_side_by_side_from_one_place(
    window: Window, qtbot, artefacts: Path
) -> None:
    session = window.session
    lasso(window, qtbot)
    sketch(window, qtbot)
    now = session.history.current_id
    window.steps.compare_asked.emit(0)
    other = window.compare.viewport
    qtbot.waitUntil(lambda: bool(other.render_window.GetReadyForRendering()))
    assert (other.vertices == session.document.original.vertices).all()
    window.viewport.turn_by(0.4, 0.1)
    assert (other.view().matrix[0] != 0).any()
    assert other.eye.azimuth == pytest.approx(window.viewport.eye.azimuth)
    other.turn_by(-0.2, 0.0)
    assert other.eye.azimuth == pytest.approx(window.viewport.eye.azimuth)
    picture(window, artefacts, "compare")
    window.compare.swap()
    qtbot.waitUntil(settled(window))
    assert session.history.current_id == 0
    assert window.compare.moment.id == now
    window.end_compare()
    assert window.compare is None
    window.viewport.turn_by(0.1, 0.0)


def test_modes_are_seen_on_the_form_and_swing(window: Window, qtbot, artefacts: Path) -> None:
    lasso(window, qtbot)
    session, level = window.session, window.level
    qtbot.waitUntil(lambda: session.decomposition.k >= 5)
    level.modes_button.setChecked(True)
    level.mode.setValue(5)
    assert window.modes.mode == 5
    assert window.modes.playing
    seen = window.viewport.vertices.copy()
    qtbot.waitUntil(lambda: bool((window.viewport.vertices != seen).any()))
    level.play.setChecked(False)
    assert not window.modes.playing
    away = window.viewport.vertices - session.shown.vertices
    roi = session.decomposition.roi
    assert np.abs(away[roi]).max() > 0.1
    assert np.abs(np.delete(away, roi, axis=0)).max() == 0
    picture(window, artefacts, "mode")
    level.slider.setValue(100)
    assert window.modes.mode is None, "anything else ends it"
    qtbot.waitUntil(settled(window))
    assert (window.viewport.vertices == session.shown.vertices).all()


def test_a_tool_set_by_options_is_previewed_and_applied(window: Window, qtbot) -> None:
    session = window.session
    lasso(window, qtbot)
    before = session.document
    window.toolhost.choose("smooth")
    qtbot.waitUntil(settled(window))
    assert session.document is before
    assert (session.shown.vertices != before.mesh.vertices).any()
    qtbot.keyClick(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == 1)
    assert session.document.recipe.steps[0].kind == "smooth"


def test_cancelling_the_modes_leaves_a_usable_window(window: Window, qtbot) -> None:
    session = window.session
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    qtbot.waitUntil(lambda: session.decomposition is not None)
    session.cancel("decompose")
    assert not session.jobs.busy("decompose")
    assert session.document.draft.roi is not None
    sketch(window, qtbot)
    assert len(session.document.recipe.steps) == 1


def test_cancelling_before_the_base_gives_the_region_up(window: Window, qtbot) -> None:
    session = window.session
    first = session.document
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    if session.decomposition is None:
        session.cancel("decompose")
        assert session.document is first
    lasso(window, qtbot)
    assert session.decomposition is not None


def test_options_of_the_edit_change_the_form_at_once(window: Window, qtbot) -> None:
    session, view = window.session, window.viewport
    lasso(window, qtbot)
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0)))
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0), -0.4))
    qtbot.waitUntil(settled(window))
    rest, full = session.document.mesh.vertices, session.shown.vertices
    moments = len(session.history.moments)
    for amount in (80, 50):
        window.edit.amount.setValue(amount)
    qtbot.waitUntil(settled(window))
    half = session.shown.vertices
    anchors = session.document.draft.strokes[0].anchors
    base = rest.copy()
    base[session.decomposition.roi] = session.decomposition.base
    way = np.linalg.norm(half[anchors] - base[anchors], axis=1)
    whole = np.linalg.norm(full[anchors] - base[anchors], axis=1)
    assert way.max() == pytest.approx(0.5 * whole.max(), rel=0.1)
    assert len(session.history.moments) == moments + 1, "a slide is one moment"


def test_the_unit_is_the_persons_choice(window: Window) -> None:
    window.actions_table.trigger("file.unit.cm")
    assert window.session.document.unit == "cm"
    assert " cm" in window.status.figures
    assert window.viewport.unit == "cm"


def test_obj_files_stand_along_y_and_u_turns_them(
    make_window, qtbot, sphere: Mesh, tmp_path: Path
) -> None:
    from engine import save

    save(sphere, tmp_path / "form.obj")
    window = make_window()
    assert window.up_axis == "z"
    window.files.open(tmp_path / "form.obj")
    qtbot.waitUntil(lambda: window.session.document is not None)
    assert window.up_axis == "y"
    qtbot.keyClick(window.viewport, Qt.Key.Key_U)
    assert window.up_axis == "z"


def test_a_picture_is_saved_on_nothing(window: Window, qtbot, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    size = (2 * window.viewport.width(), 2 * window.viewport.height())
    window.picture_files.save(tmp_path / "form.png", size)
    assert soon((tmp_path / "form.png").exists)
    image = QImage(str(tmp_path / "form.png"))
    assert image.width() == 2 * window.viewport.width()
    assert image.pixelColor(2, 2).alpha() == 0
    assert image.pixelColor(image.width() // 2, image.height() // 2).alpha() == 255


def test_a_repaired_file_says_so_and_can_be_taken_as_it_is(
    make_window, qtbot, sphere: Mesh, tmp_path: Path
) -> None:
    doubled = tmp_path / "doubled.obj"
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in sphere.vertices]
    faces = np.concatenate([sphere.faces, sphere.faces[:3]]) + 1
    lines += [f"f {a} {b} {c}" for a, b, c in faces]
    doubled.write_text("\n".join(lines) + "\n")
    window = make_window()
    window.files.open(doubled)
    qtbot.waitUntil(lambda: window.session.document is not None)
    assert len(window.session.document.mesh.faces) == len(sphere.faces)
    qtbot.waitUntil(window.plate.isVisible)
    assert "doubled.obj" in window.plate.text
    # It was read once: nobody asks the file again.
    doubled.unlink()
    qtbot.mouseClick(window.plate.buttons["Open without repairs"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(window.session.document.mesh.faces) == len(faces))


def test_what_may_be_missing_is_told_on_opening(
    make_window, qtbot, tmp_path: Path, sphere: Mesh
) -> None:
    """How many faces a text STL without its last line has lost, nobody knows; it may have."""
    lines = ["solid sphere"]
    for corners in sphere.vertices[sphere.faces]:
        told = [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
        lines += ["facet normal 0 0 0", "outer loop", *told, "endloop", "endfacet"]
    cut = tmp_path / "cut.stl"
    cut.write_text("\n".join(lines) + "\n")
    window = make_window()
    window.files.open(cut)
    qtbot.waitUntil(lambda: window.session.document is not None)
    qtbot.waitUntil(window.plate.isVisible)
    assert "may be cut off" in window.plate.text
