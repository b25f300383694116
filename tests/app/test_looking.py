"""Ways to look, by keys, menus and mouse in a rendered window: what is seen is measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QFileDialog

from app.seeing import PictureDialog
from app.window import Window
from engine import Mesh
from tests.app.driving import (
    Mouse,
    bow,
    bumpy_sphere,
    circle,
    in_dialog,
    picture,
    pixels,
    press,
    settled,
    soon,
    through_menus,
)

LEFT, MIDDLE = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton
SHIFT = Qt.KeyboardModifier.ShiftModifier
Image = NDArray[np.int64]


def at_rest(window: Window, qtbot) -> None:
    qtbot.waitUntil(settled(window))
    qtbot.waitUntil(lambda: not window.viewport.moving)


def on_form(window: Window) -> Image:
    """The middle of the form, (p, 3): its pixels that nothing lies over."""
    seen = pixels(window.viewport)
    h, w = seen.shape[:2]
    return seen[round(0.3 * h) : round(0.7 * h), round(0.4 * w) : round(0.6 * w)].reshape(-1, 3)


def dark(form: Image) -> float:
    """Share of pixels that are nearly black."""
    return float((form.max(axis=1) < 60).mean())


def red_of(form: Image) -> float:
    """How much more red than blue there is, 0 to 255."""
    return float((form[:, 0] - form[:, 2]).mean())


def blue(form: Image) -> float:
    return float((form[:, 2] - form[:, 0] > 30).mean())


def orange(form: Image) -> float:
    """Share of pixels more orange than clay ever is."""
    return float((form[:, 0] - form[:, 2] > 90).mean())


def region(window: Window, qtbot, radius: float = 0.2) -> None:
    Mouse().stroke(window, circle(window.viewport, 0, 0, radius))
    at_rest(window, qtbot)


def bulge(window: Window, qtbot) -> None:
    """Pull the middle of the form out and apply it."""
    region(window, qtbot)
    ends = (-0.1, 0.0), (0.1, 0.0)
    Mouse().stroke(window, bow(window.viewport, *ends))
    Mouse().stroke(window, bow(window.viewport, *ends, -0.4))
    at_rest(window, qtbot)
    press(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: bool(window.session.document.recipe.steps))
    at_rest(window, qtbot)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_every_shading_is_a_key_or_a_click_away(
    make_window, qtbot, artefacts: Path, theme: str
) -> None:
    window = make_window(bumpy_sphere(bumps=0.15), theme)
    view = window.viewport
    at_rest(window, qtbot)
    clay = on_form(window)
    press(view, Qt.Key.Key_Z)
    at_rest(window, qtbot)
    zebra = on_form(window)
    assert dark(zebra) > 0.2 > 0.1 > dark(clay), "black stripes"
    assert (zebra.min(axis=1) > 150).mean() > 0.2, "and white ones"
    picture(window, artefacts, f"zebra {theme}")

    through_menus(window, "View", "Reflection lines")
    at_rest(window, qtbot)
    lines = on_form(window)
    assert window.actions_table.qt["view.reflection"].isChecked()
    assert not window.actions_table.qt["view.zebra"].isChecked()
    assert dark(clay) + 0.03 < dark(lines) < dark(zebra), "fine dark lines"
    picture(window, artefacts, f"reflection {theme}")

    press(view, Qt.Key.Key_C)
    at_rest(window, qtbot)
    bumps = on_form(window)
    assert blue(bumps) > 0.05, "hollows are blue"
    assert orange(bumps) > 0.05, "crests are orange"
    assert view.overlay.legend.title == "Mean curvature, 1/mm"
    picture(window, artefacts, f"curvature {theme}")
    press(view, Qt.Key.Key_C)
    assert view.overlay.legend is None

    through_menus(window, "View", "Wireframe")
    at_rest(window, qtbot)
    edges = on_form(window)
    assert np.abs(edges - clay).mean() > 5
    assert edges.mean() < clay.mean() - 2, "edges are darker than clay"
    picture(window, artefacts, f"wireframe {theme}")
    press(view, Qt.Key.Key_W)
    at_rest(window, qtbot)
    assert np.abs(on_form(window) - clay).max() <= 2, "and it is clay again"


def test_deviation_has_colours_where_the_form_moved_and_a_scale_beside_it(
    window: Window, qtbot, artefacts: Path
) -> None:
    view = window.viewport
    bulge(window, qtbot)
    press(view, Qt.Key.Key_Escape)
    at_rest(window, qtbot)
    press(view, Qt.Key.Key_D)
    at_rest(window, qtbot)
    away = view.deviation()
    legend = view.overlay.legend
    assert legend.title == "Deviation, mm"
    most = float(legend.high)
    assert np.abs(away).max() <= most <= 1.5 * np.abs(away).max()
    where = view.view().project(view.vertices)
    seen = pixels(view)

    def colour(vertex: int) -> NDArray[np.int64]:
        x, y = (where[vertex] * view.devicePixelRatioF()).round().astype(int)
        return seen[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).mean(axis=0)

    red, _, blue_ = colour(int(away.argmax()))
    assert red > blue_ + 60, "what came out is orange"
    still = np.flatnonzero(away == 0)
    facing = still[view.form.vertex_normals[still] @ (0.5, -0.8, 0.3) > 0.9]
    for one in facing[:5]:
        assert np.ptp(colour(int(one))) < 40, "what did not move is grey"
    # The scale lies beside the form, not on it.
    card = seen[-130:-70, -180:-20]
    assert (card[..., 2] - card[..., 0] > 60).any(), "the scale runs from blue"
    assert (card[..., 0] - card[..., 2] > 60).any(), "to orange"
    picture(window, artefacts, "deviation")


def test_the_base_alone_is_seen_in_any_shading_and_the_level_stays(
    window: Window, qtbot, artefacts: Path
) -> None:
    view, session = window.viewport, window.session
    assert not window.actions_table.qt["view.base"].isEnabled(), "there is no region yet"
    region(window, qtbot)
    press(view, Qt.Key.Key_BraceRight)  # full detail
    at_rest(window, qtbot)
    assert session.document.draft.level == 1.0
    known = session.decomposition
    roi = known.roi
    form = view.vertices.copy()
    assert (form == session.document.mesh.vertices).all()
    press(view, Qt.Key.Key_Z)
    at_rest(window, qtbot)
    rough = on_form(window)

    press(view, Qt.Key.Key_B, SHIFT)
    at_rest(window, qtbot)
    assert (view.vertices[roi] == known.base).all()
    outside = np.setdiff1d(np.arange(len(form)), roi)
    assert (view.vertices[outside] == form[outside]).all()
    assert session.document.draft.level == 1.0
    assert "base" in window.hint.text
    assert window.actions_table.qt["view.base"].isChecked()
    smooth = on_form(window)
    assert (np.abs(smooth - rough).max(axis=1) > 60).mean() > 0.1, "other stripes"
    picture(window, artefacts, "base zebra")
    press(view, Qt.Key.Key_D)
    at_rest(window, qtbot)
    moved = np.abs(view.deviation())
    assert moved[roi].max() > 0.5
    assert moved[outside].max() == 0
    picture(window, artefacts, "base deviation")

    press(view, Qt.Key.Key_B, SHIFT)
    assert (view.vertices == form).all(), "the same key brings the form back"
    assert "base" not in window.hint.text
    for leave in (
        lambda: press(view, Qt.Key.Key_BracketLeft),
        lambda: Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0))),
    ):
        through_menus(window, "View", "Base alone")
        assert window.stage.base_alone
        leave()
        at_rest(window, qtbot)
        assert not window.stage.base_alone, "whatever is done next is seen"
        assert (view.vertices == session.shown.vertices).all()


def test_views_by_keys_menu_and_cube(window: Window, qtbot) -> None:
    view = window.viewport

    def facing() -> str:
        qtbot.waitUntil(lambda: not view.moving)
        return view.cube.face_at(view.cube.rect().center().toPointF())

    for key, name in ((Qt.Key.Key_1, "front"), (Qt.Key.Key_3, "right"), (Qt.Key.Key_7, "top")):
        press(view, key)
        assert facing() == name
    through_menus(window, "View", "Standard views", "From the back")
    assert facing() == "back"
    assert view.eye.elevation == pytest.approx(0)

    seen = pixels(view)
    press(view, Qt.Key.Key_5)
    at_rest(window, qtbot)
    assert not view.perspective
    axis = view.view().matrix[3]
    assert (axis[:3] == 0).all(), "nothing gets smaller with distance"
    assert np.abs(pixels(view) - seen).max() > 30
    press(view, Qt.Key.Key_5)
    at_rest(window, qtbot)
    assert view.perspective

    press(view, Qt.Key.Key_0)
    qtbot.waitUntil(lambda: not view.moving)
    for side in ("right", "top"):
        press(view, Qt.Key.Key_0)
        qtbot.waitUntil(lambda: not view.moving)
        place = view.cube._corners(side).mean(axis=0).astype(int)
        qtbot.mouseClick(view.cube, LEFT, pos=QPoint(*place.tolist()))
        assert facing() == side


def test_the_turntable_is_switched_on_and_a_hand_stops_it(window: Window, qtbot) -> None:
    view = window.viewport
    at_rest(window, qtbot)
    before, azimuth = pixels(view), view.eye.azimuth
    through_menus(window, "View", "Turntable")
    qtbot.waitUntil(lambda: abs(view.eye.azimuth - azimuth) > 0.1)
    assert np.abs(pixels(view) - before).max() > 30
    QTest.mousePress(view, MIDDLE, Qt.KeyboardModifier.NoModifier, view.rect().center())
    QTest.mouseRelease(view, MIDDLE, Qt.KeyboardModifier.NoModifier, view.rect().center())
    assert not view.turntable
    bar = window.menuBar()
    action = next(a for a in bar.actions() if a.text() == "&View")
    qtbot.mouseClick(bar, LEFT, pos=bar.actionGeometry(action).center())
    assert not window.actions_table.qt["view.turntable"].isChecked(), "the menu knows"
    action.menu().close()


def test_ambient_occlusion_says_what_it_needs_or_darkens_grooves(
    make_window, qtbot, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = make_window(bumpy_sphere(bumps=0.15))
    view = window.viewport
    at_rest(window, qtbot)
    plain = on_form(window)
    if view.software:
        press(view, Qt.Key.Key_A)
        assert window.hint.text == "Ambient occlusion needs a graphics card"
        assert not window.actions_table.qt["view.occlusion"].isChecked()
        monkeypatch.setattr(view, "_software", False)
    press(view, Qt.Key.Key_A)
    assert window.actions_table.qt["view.occlusion"].isChecked()
    qtbot.waitUntil(lambda: not view.moving)
    occluded = on_form(window)
    press(view, Qt.Key.Key_A)
    away = plain - occluded
    assert np.percentile(away, 98) > 3 > -np.percentile(away, 2), "some places darker, none lighter"


def test_a_view_is_kept_taken_up_and_forgotten_from_the_menu(window: Window, qtbot) -> None:
    view = window.viewport
    press(view, Qt.Key.Key_3)
    at_rest(window, qtbot)
    kept = pixels(view)
    through_menus(window, "View", "Keep this view")
    QTest.keyClick(window.ask.line, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(window.ask.line, "Side")
    press(window.ask.line, Qt.Key.Key_Return)
    press(view, Qt.Key.Key_7)
    at_rest(window, qtbot)
    h = kept.shape[0] - 90  # the hint is another now
    assert np.abs(pixels(view)[:h] - kept[:h]).mean() > 0.5
    through_menus(window, "View", "Kept views", "Side", "Look from here")
    at_rest(window, qtbot)
    assert np.abs(pixels(view)[:h] - kept[:h]).mean() < 0.2
    through_menus(window, "View", "Kept views", "Side", "Forget")
    assert not window.session.document.views


def test_a_picture_is_saved_through_its_dialog(
    window: Window, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, artefacts: Path
) -> None:
    target = tmp_path / "form.png"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_args: (str(target), ""))

    def fill(dialog: PictureDialog) -> None:
        QTest.keyClick(dialog.width_box, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClicks(dialog.width_box, "640")
        if dialog.transparent.isChecked() != transparent:
            press(dialog.transparent, Qt.Key.Key_Space)
        dialog.grab().save(str(artefacts / "save a picture.png"))
        box = dialog.findChild(QDialogButtonBox)
        QTest.mouseClick(box.button(QDialogButtonBox.StandardButton.Save), LEFT)

    for transparent in (True, False):
        with in_dialog(PictureDialog, fill):
            through_menus(window, "View", "Save a picture")
        assert soon(lambda: not window.session.writing.busy)
        image = QImage(str(target))
        ratio = window.viewport.height() / window.viewport.width()
        assert (image.width(), image.height()) == (640, round(640 * ratio))
        assert (image.pixelColor(2, 2).alpha() == 0) is transparent
        assert image.pixelColor(320, image.height() // 2).alpha() == 255
        assert window.hint.text == "Picture saved to form.png"


def test_a_picture_to_trace_is_chosen_faded_by_keys_and_removed(
    window: Window, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    red = QImage(100, 100, QImage.Format.Format_RGB32)
    red.fill(QColor("#ff0000"))
    red.save(str(tmp_path / "trace.png"))
    chosen = (str(tmp_path / "trace.png"), "")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_args: chosen)
    at_rest(window, qtbot)
    plain = on_form(window)
    through_menus(window, "View", "Picture to trace")
    bar = window.trace_bar
    assert soon(bar.isVisible)
    at_rest(window, qtbot)
    assert not bar.geometry().intersects(window.body.split.geometry()), "below the form, not on it"
    assert red_of(on_form(window)) > red_of(plain) + 20, "red lies over the form"
    press(bar.fade, Qt.Key.Key_Home)
    assert abs(red_of(on_form(window)) - red_of(plain)) <= 2, "faded to nothing"
    press(bar.fade, Qt.Key.Key_End)
    assert (on_form(window) == (255, 0, 0)).all(), "nothing but the picture"
    for _ in range(9):
        press(bar.across, Qt.Key.Key_PageUp)
    assert (on_form(window) != (255, 0, 0)).any(), "moved aside"
    remove = next(b for b in bar.children() if getattr(b, "text", str)() == "Remove")
    qtbot.mouseClick(remove, LEFT)
    assert soon(lambda: len(on_form(window)) == len(plain)), "its room is the form's again"
    at_rest(window, qtbot)
    assert np.abs(on_form(window) - plain).max() <= 2


def test_two_compared_forms_are_coloured_alike(
    make_window, sphere: Mesh, qtbot, artefacts: Path
) -> None:
    window = make_window(sphere, size=(1280, 720))
    bulge(window, qtbot)
    window.steps.compare_asked.emit(0)
    other = window.compare.viewport
    qtbot.waitUntil(lambda: bool(other.render_window.GetReadyForRendering()))
    press(window.viewport, Qt.Key.Key_Z)
    at_rest(window, qtbot)
    middle = pixels(other)
    h, w = middle.shape[:2]
    middle = middle[round(0.4 * h) : round(0.6 * h), round(0.4 * w) : round(0.6 * w)].reshape(-1, 3)
    assert dark(middle) > 0.2
    assert dark(on_form(window)) > 0.2
    picture(window, artefacts, "compared zebra")
