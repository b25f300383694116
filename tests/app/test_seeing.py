"""Kept views, pictures, tracing, measuring, navigating, flipping, units, heavy files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage

from app.seeing import PictureDialog
from app.sizes import likely_unit
from app.viewport.recall import eye_from
from app.window import Window
from engine import Document, Mesh
from tests.app.driving import Mouse, Pen, bow, circle, picture, settled, soon


@pytest.mark.parametrize("perspective", [True, False])
@pytest.mark.parametrize("up", ["z", "y"])
def test_a_kept_view_is_taken_up_again(window: Window, perspective: bool, up: str) -> None:
    view = window.viewport
    window.set_up_axis(up)
    view.set_perspective(perspective)
    eye = view.eye.orbited(view.eye.centre, 1.1, -0.3)
    view.look(eye, animate=False)
    kept = view.view()
    again = eye_from(kept, view.scene.placement, view.eye.up)
    view.standard_view("top")
    view.look(again, animate=False)
    points = window.session.document.mesh.vertices
    assert np.abs(view.view().project(points) - kept.project(points)).max() < 0.05


def test_views_are_kept_in_the_document(window: Window, qtbot) -> None:
    window.actions_table.trigger("view.keep")
    window.ask.line.setText("Front left")
    qtbot.keyClick(window.ask.line, Qt.Key.Key_Return)
    assert list(window.session.document.views) == ["Front left"]
    window.menus.views.aboutToShow.emit()
    assert [a.text() for a in window.menus.views.actions()] == ["Front left"]
    window.session.undo()
    assert not window.session.document.views


@pytest.mark.parametrize("hand", [Mouse(), Pen()], ids=["mouse", "pen"])
def test_the_navigate_tool_turns_the_view(window: Window, hand: Mouse) -> None:
    window.actions_table.trigger("tool.navigate")
    before, document = window.viewport.eye, window.session.document
    hand.stroke(window, bow(window.viewport, (-0.1, 0.0), (0.1, 0.05)))
    assert window.viewport.eye.azimuth != before.azimuth
    assert window.session.document is document
    window.actions_table.trigger("tool.lasso")
    turned = window.viewport.eye
    hand.stroke(window, circle(window.viewport, 0, 0, 0.1))
    assert window.viewport.eye is turned
    assert window.session.document.draft.roi is not None


def test_measuring_shows_the_distance_until_the_tool_is_put_away(
    window: Window, qtbot, artefacts: Path
) -> None:
    view = window.viewport
    qtbot.keyClick(view, Qt.Key.Key_M)
    path = bow(view, (-0.1, 0.0), (0.1, 0.0))
    a, b = view.pick(*path[0]), view.pick(*path[-1])
    Mouse().stroke(window, path, release=False)
    length = np.linalg.norm(a.point - b.point)
    assert f"{length:.4g} mm" in window.hint.text
    Mouse().send(view, "release", path[-1], Qt.KeyboardModifier.NoModifier)
    picture(window, artefacts, "measure")
    assert view.overlay.curve("span") is not None
    qtbot.keyClick(view, Qt.Key.Key_L)
    assert view.overlay.curve("span") is None


def test_a_picture_has_the_size_and_the_background_asked_for(
    window: Window, tmp_path: Path
) -> None:
    dialog = PictureDialog(window.viewport, window)
    dialog.width_box.setValue(640)
    width, height = dialog.size_in_pixels
    assert width == 640
    for transparent in (True, False):
        window.picture_files.save(tmp_path / "picture.png", (width, height), transparent)
        assert soon(lambda: not window.session.writing.busy)
        image = QImage(str(tmp_path / "picture.png"))
        assert (image.width(), image.height()) == (width, height)
        assert (image.pixelColor(2, 2).alpha() == 0) is transparent
        assert image.pixelColor(width // 2, height // 2).alpha() == 255
    dialog.deleteLater()


def test_a_picture_to_trace_is_faded_moved_and_removed(
    window: Window, tmp_path: Path, artefacts: Path
) -> None:
    image = QImage(200, 100, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.red)
    image.save(str(tmp_path / "trace.png"))
    window.picture_files.trace(tmp_path / "trace.png")
    bar, overlay = window.trace_bar, window.viewport.overlay
    assert soon(bar.isVisible)
    bar.fade.setValue(20)
    bar.size_slider.setValue(50)
    before = overlay.backdrop.place
    bar.across.setValue(40)
    assert overlay.backdrop.opacity == pytest.approx(0.2)
    assert overlay.backdrop.place.left() > before.left()
    # The bar below the form takes some of the height, and the picture shrinks with the form.
    assert 0.4 < before.width() / window.viewport.width() <= 0.5
    picture(window, artefacts, "trace")
    # Where it lies on the form it stays when there is more or less room for both.
    height, placed = window.viewport.height(), overlay.backdrop.place
    window.resize(window.width(), window.height() + 120)
    assert soon(lambda: window.viewport.height() > height)
    grown = window.viewport.height() / height
    assert overlay.backdrop.place.height() == pytest.approx(grown * placed.height(), rel=0.01)
    bar.remove()
    assert overlay.backdrop is None
    (tmp_path / "no.png").write_text("no picture", encoding="utf-8")
    window.picture_files.trace(tmp_path / "no.png")
    assert soon(lambda: "not a picture" in window.session.problems.sentence)


def test_v_flips_between_two_steps(window: Window, qtbot) -> None:
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    qtbot.waitUntil(settled(window))
    later = window.session.history.current_id
    window.session.undo()
    first = window.session.history.current_id
    for wanted in (later, first, later):
        qtbot.keyClick(window.viewport, Qt.Key.Key_V)
        assert window.session.history.current_id == wanted


@pytest.mark.parametrize(
    ("size", "unit"),
    [(0.2, "m"), (0.4, "m"), (2.0, "cm"), (100.0, None), (3000.0, None), (1e-4, None)],
)
def test_an_odd_size_suggests_another_unit(sphere: Mesh, size: float, unit: str | None) -> None:
    scaled = sphere.with_vertices(sphere.vertices * size / sphere.diagonal)
    assert likely_unit(Document.open(scaled)) == unit


def test_the_unit_is_asked_for_when_the_size_is_odd(make_window, qtbot, sphere: Mesh) -> None:
    window = make_window(sphere.with_vertices(sphere.vertices / 1000))
    qtbot.waitUntil(window.plate.isVisible)
    assert "One unit is more likely a metre than a millimetre" in window.plate.text
    qtbot.mouseClick(window.plate.buttons["Metre"], Qt.MouseButton.LeftButton)
    assert window.session.document.unit == "m"
    assert not window.plate.isVisible()


def test_a_file_that_takes_much_memory_is_asked_for(
    window: Window, qtbot, sphere_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("engine.estimate", lambda _path: 3 * 2**30)
    document = window.session.document
    window.files.open(sphere_file)
    qtbot.waitUntil(window.plate.isVisible)
    assert "3.0 GiB" in window.plate.text
    assert window.session.document is document
    qtbot.mouseClick(window.plate.buttons["Open"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: window.session.document is not document)
