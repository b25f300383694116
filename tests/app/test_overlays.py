"""What lies over the form: where it is, and that a pen on it does not draw below it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtWidgets import QApplication, QLabel, QPushButton

from app.free_place import covered, free_place
from app.opening_plate import form_seen
from app.plugin_list import PluginList
from app.window import Window
from engine import Mesh
from tests.app.driving import NONE, Mouse, Pen, circle, picture, pixels

ROOM = QSize(800, 600)
PLATE = QSize(300, 100)
EMPTY = np.zeros((0, 2))


def test_the_first_corner_that_covers_nothing_is_taken() -> None:
    which, corner = free_place(ROOM, [PLATE], [], EMPTY)
    assert (which, corner.x(), corner.y()) == (0, 16, 16)
    _, corner = free_place(ROOM, [PLATE], [], np.array([[100.0, 60.0]]))
    assert (corner.x(), corner.y()) == (16, 600 - 100 - 16)
    _, corner = free_place(ROOM, [PLATE], [QRect(0, 0, 20, 600)], EMPTY)
    assert corner.x() == 800 - 300 - 16


def test_a_narrower_plate_is_better_than_a_covered_form() -> None:
    form = np.column_stack([np.full(40, 250.0), np.linspace(0, 600, 40)])
    form = np.vstack([form, form + np.array([300, 0])])
    which, _ = free_place(ROOM, [PLATE, QSize(200, 140)], [], form)
    assert which == 1


def test_where_all_is_covered_the_least_is() -> None:
    form = np.column_stack([one.ravel() for one in np.meshgrid(np.arange(800), np.arange(500))])
    _, corner = free_place(ROOM, [PLATE], [], form.astype(float))
    assert corner.y() == 600 - 100 - 16


@pytest.mark.window
@pytest.mark.parametrize("size", [(1280, 860), (1180, 800)])
def test_the_question_about_the_unit_covers_nothing_of_a_slim_form(
    make_window, sphere: Mesh, qtbot, artefacts: Path, size: tuple[int, int]
) -> None:
    slim = sphere.with_vertices(sphere.vertices * np.array([0.4, 0.4, 1.0]) / 1000)
    window = make_window(slim, "light", size)
    qtbot.waitUntil(window.plate.isVisible)
    QApplication.processEvents()
    picture(window, artefacts, f"unit {size[0]}")
    place = window.plate.geometry()
    seen = form_seen(window.session, window.viewport)
    x, y = seen.T
    inside = (x > place.left()) & (x < place.right()) & (y > place.top()) & (y < place.bottom())
    assert not inside.any()
    assert window.viewport.rect().contains(place)
    assert not place.intersects(window.hint.geometry())
    for button in window.plate.buttons.values():
        assert button.width() >= button.sizeHint().width(), "no words are cut off"
        assert window.plate.rect().contains(button.geometry())


@pytest.mark.window
def test_the_plate_goes_out_of_the_way(make_window, sphere: Mesh, qtbot, artefacts: Path) -> None:
    flat = sphere.with_vertices(sphere.vertices * np.array([0.4, 3.0, 1.0]) / 1000)
    window = make_window(flat, "light", (1280, 860))
    view, plate = window.viewport, window.plate
    qtbot.waitUntil(plate.isVisible)
    # From every side where there is room beside the form, and whatever the hint says.
    for key in (Qt.Key.Key_1, Qt.Key.Key_3, Qt.Key.Key_7, Qt.Key.Key_1):
        qtbot.keyClick(view, key)
        qtbot.waitUntil(lambda: not view.moving)
        seen = form_seen(window.session, view)
        free = lambda: covered(plate.geometry(), [window.hint.geometry()], seen) == 0  # noqa: B023, E731
        qtbot.waitUntil(free)
    window.hint.set_notice("What is said at length takes more of the room below the form. " * 4)
    qtbot.waitUntil(lambda: not plate.geometry().intersects(window.hint.geometry()))
    picture(window, artefacts, "plate beside a long hint")
    # Who has begun to work has no use for it; the size brings it back.
    window.hint.set_notice("")
    Mouse().stroke(window, circle(view, 0.0, 0.0, 0.1))
    qtbot.waitUntil(lambda: window.session.document.draft.roi is not None)
    assert not plate.isVisible()
    size = window.status.size_button
    assert size.text().endswith(" mm ?"), "the unit is still in doubt"
    qtbot.mouseClick(size, Qt.MouseButton.LeftButton)
    assert plate.isVisible()
    qtbot.mouseClick(plate.buttons["Metre"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: size.text().endswith(" m"))
    assert window.session.document.draft.roi is not None
    qtbot.waitUntil(view.hasFocus)
    qtbot.mouseClick(size, Qt.MouseButton.LeftButton)
    assert "What is one unit of it?" in plate.text


@pytest.mark.window
def test_a_pen_on_a_plate_does_not_draw_on_the_form(window: Window, qtbot) -> None:
    pressed: list[str] = []
    window.viewport.pointer.connect(lambda pointer: pressed.append(pointer.kind))
    window.plate.say("A question", ["Which?"], {"This": lambda: None})
    for part in (*window.plate.findChildren(QLabel), *window.plate.findChildren(QPushButton)):
        centre = part.rect().center()
        Pen().send(part, "press", (centre.x(), centre.y()), NONE)
        Pen().send(part, "release", (centre.x(), centre.y()), NONE)
    assert "press" not in pressed


@pytest.mark.window
def test_the_headings_of_the_plugin_list_begin_where_its_lines_do(
    window: Window, qtbot, artefacts: Path
) -> None:
    listed = PluginList(window.toolhost, (), window)
    with qtbot.waitExposed(listed):
        listed.show()
    listed.grab().save(str(artefacts / "plugins.png"))
    head, line = (one_label(listed, words) for words in ("Tools", "Lasso"))
    # The same word in both: where its ink begins is then the label's own doing.
    begins = []
    for label in (head, line):
        label.setText("Hat")
        QApplication.processEvents()
        seen = pixels(label)
        ink = np.abs(seen - seen[-1, -1]).sum(axis=2) > 120
        at = label.mapTo(listed, label.rect().topLeft()).x()
        begins.append(at + int(np.flatnonzero(ink.any(axis=0))[0]))
    assert abs(begins[0] - begins[1]) <= 1


def one_label(listed: PluginList, words: str) -> QLabel:
    return next(label for label in listed.findChildren(QLabel) if label.text() == words)
