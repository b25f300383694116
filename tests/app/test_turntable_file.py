"""Pictures at an exact size, and a turn of the form as a moving picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QFileDialog

from app.seeing import PictureDialog
from app.window import Window
from tests.app.driving import LEFT, in_dialog, press, soon, through_menus

pytestmark = pytest.mark.window
CTRL = Qt.KeyboardModifier.ControlModifier


def typed(box, number: str) -> None:
    """Type a number over what stands in a field."""
    QTest.keyClick(box, Qt.Key.Key_A, CTRL)
    QTest.keyClicks(box, number)


def confirmed(dialog: PictureDialog) -> None:
    """Press the button that saves."""
    box = dialog.findChild(QDialogButtonBox)
    QTest.mouseClick(box.button(QDialogButtonBox.StandardButton.Save), LEFT)


def rows_and_columns(image: Image.Image) -> tuple[slice, slice]:
    """Where a picture on nothing has something."""
    seen = np.asarray(image.convert("RGBA"))[..., 3] > 127
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


@pytest.mark.parametrize(("width", "height"), [(300, 600), (640, 200)])
def test_a_picture_has_exactly_the_size_asked_for_and_all_of_the_form(
    window: Window,
    qtbot,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    width: int,
    height: int,
) -> None:
    target = tmp_path / "form.png"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_args: (str(target), ""))
    press(window.viewport, Qt.Key.Key_F)
    qtbot.waitUntil(lambda: not window.viewport.moving)

    def fill(dialog: PictureDialog) -> None:
        typed(dialog.width_box, str(width))
        ratio = window.viewport.height() / window.viewport.width()
        assert dialog.height_box.value() == round(width * ratio), "the height follows"
        typed(dialog.height_box, str(height))
        assert dialog.width_box.value() == width
        confirmed(dialog)

    with in_dialog(PictureDialog, fill):
        through_menus(window, "View", "Save a picture")
    assert soon(lambda: not window.session.writing.busy)
    with Image.open(target) as image:
        assert image.size == (width, height)
        rows, columns = rows_and_columns(image)
    assert rows.start > 0, "nothing is cut off above"
    assert rows.stop < height
    assert columns.start > 0
    assert columns.stop < width
    tall, wide = rows.stop - rows.start, columns.stop - columns.start
    assert tall == pytest.approx(wide, rel=0.15), "a ball stays one"


@pytest.mark.parametrize("kind", ["webp", "gif"])
def test_a_turn_of_the_form_is_saved_as_a_moving_picture(
    window: Window, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr("app.turntable_file.FRAMES", 9)
    target = tmp_path / f"form.{kind}"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_args: (str(target), ""))
    before = window.viewport.eye

    def fill(dialog: PictureDialog) -> None:
        typed(dialog.width_box, "160")
        typed(dialog.height_box, "120")
        confirmed(dialog)

    with in_dialog(PictureDialog, fill):
        through_menus(window, "View", "Save a turntable")
    assert window.turntable_file.under_way
    qtbot.waitUntil(lambda: window.hint.text == f"Turntable saved to form.{kind}")
    assert window.viewport.eye.same_as(before), "it ends where it began"
    frames = []
    with Image.open(target) as image:
        assert (image.size, image.n_frames) == ((160, 120), 9)
        for number in range(9):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB"), dtype=float))
            assert image.info["duration"] == 80
    steps = [np.abs(a - b).mean() for a, b in zip(frames, frames[1:] + frames[:1], strict=True)]
    assert min(steps) > 0.5, "it turns from frame to frame, and from the last to the first"


def test_whoever_takes_hold_of_the_form_ends_the_turn(
    window: Window, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.turntable_file.FRAMES", 10**6)  # it does not end by itself
    window.turntable_file.save(tmp_path / "form.gif", (160, 120))
    press(window.viewport, Qt.Key.Key_Right)
    qtbot.waitUntil(lambda: not window.turntable_file.under_way)
    assert "not saved" in window.hint.text
    assert not list(tmp_path.glob("form*"))
    window.turntable_file.save(tmp_path / "form.docx", (160, 120))
    assert "form.docx names no kind of moving picture" in window.hint.text
    assert not window.turntable_file.under_way
