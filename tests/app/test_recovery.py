"""Work that a killed program left: offered at the next start, restored, set aside."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
from PIL import Image
from PySide6.QtCore import QPoint, QSize, Qt
from PySide6.QtGui import QGuiApplication

from app.recovery_bar import sentence
from engine.files.place import beside
from engine.journal import recover
from plugins.registry import kinds
from tests.app.driving import picture, pixels, settled
from tests.app.safe import killed, work
from tests.engine.histories import fingerprint


def test_what_was_killed_is_offered_and_restored(
    safe_window, qtbot, artefacts: Path, tmp_path: Path
) -> None:
    window = safe_window()
    state = work(window, qtbot)
    killed(window)
    (tmp_path / "state" / "native-1-aa.log").write_text("Fatal Python error: Segmentation fault")
    after = safe_window()
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    bar = after.safety.bar
    assert "Eigenform crashed." in bar.text
    assert "“sphere.ply”" in bar.text
    assert "one step" in bar.text
    assert set(bar.buttons) == {"Restore", "Discard", "Later"}
    for size in (QSize(1000, 720), QSize(660, 500)):
        after.resize(size)
        qtbot.waitUntil(lambda: bar.width() < after.viewport.width())
        assert after.viewport.rect().contains(bar.geometry())
        # No button is cut off.
        qtbot.waitUntil(
            lambda: all(one.width() >= one.sizeHint().width() for one in bar.buttons.values())
        )
        picture(after, artefacts, f"offer {size.width()}")
    qtbot.mouseClick(bar.buttons["Restore"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(settled(after))
    assert fingerprint(after.session.history.state()) == fingerprint(state)
    assert after.safety.autosave.unsaved
    assert "crashed the last time" in bar.text
    qtbot.mouseClick(bar.buttons["Copy report"], Qt.MouseButton.LeftButton)
    assert "Segmentation fault" in QGuiApplication.clipboard().text()
    qtbot.mouseClick(bar.buttons["Close"], Qt.MouseButton.LeftButton)
    assert not bar.isVisible()
    # Only the journal of the running window is left, and it holds everything.
    assert after.safety.autosave.flush()
    assert len(list(after.safety.autosave.folder.iterdir())) == 1
    killed(after)
    (again,) = recover(after.safety.autosave.folder, kinds())
    assert fingerprint(again.state) == fingerprint(state)
    again.release()


def test_every_step_that_was_restored_has_a_picture_of_its_form(safe_window, qtbot) -> None:
    window = safe_window()
    work(window, qtbot)
    killed(window)
    after = safe_window()
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    qtbot.mouseClick(after.safety.bar.buttons["Restore"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(settled(after))
    history = after.session.history
    (first,) = (one for one, moment in history.moments.items() if moment.parent is None)
    assert history.current_id != first
    qtbot.waitUntil(lambda: first in after.steps.pictures())
    assert not after.steps.without_picture()
    qtbot.waitUntil(lambda: not after.viewport.moving)
    made = pixels_of(after.steps.pictures()[first])
    seen = pixels(after.viewport)
    after.session.go(first)
    qtbot.waitUntil(settled(after))
    assert made.std() > 15, "a form on its ground"
    assert after.viewport.renderer.GetDraw()
    assert after.viewport.render_window.GetRenderers().GetNumberOfItems() == 1
    assert seen.std() > 15, "and the form itself is still on screen"


def pixels_of(png: bytes) -> np.ndarray:
    """Return a PNG as (h, w, 3), 0 to 255."""
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


def test_discard_and_later(safe_window, qtbot) -> None:
    for _ in range(2):
        window = safe_window()
        work(window, qtbot)
        killed(window)
        window.safety.offers.release()
    after = safe_window()
    folder = after.safety.autosave.folder
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    assert "1 more after this" in after.safety.bar.text
    after.safety.bar.buttons["Discard"].click()
    assert "more after this" not in after.safety.bar.text
    after.safety.bar.buttons["Later"].click()
    assert not after.safety.bar.isVisible()
    (left,) = recover(folder, kinds())
    assert sentence(left).startswith("Eigenform did not close properly.")
    left.release()


def test_a_pointer_on_the_bar_does_not_draw(safe_window, qtbot) -> None:
    window = safe_window()
    work(window, qtbot)
    killed(window)
    after = safe_window()
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    moments = len(after.session.history.moments)
    qtbot.mouseClick(after.safety.bar, Qt.MouseButton.LeftButton, pos=QPoint(4, 4))
    assert not after.toolhost.in_gesture
    assert len(after.session.history.moments) == moments
    after.safety.offers.release()


def test_logging_out_keeps_the_work_for_the_next_start(safe_window, qtbot) -> None:
    window = safe_window()
    work(window, qtbot)
    window.safety._system_ends()
    assert window.close()
    (found,) = recover(window.safety.autosave.folder, kinds())
    assert found.why == "closed"
    assert "closed by the system" in sentence(found)
    found.release()


def test_what_killed_saves_left_is_swept_at_the_next_start(
    safe_window, qtbot, sphere_file: Path
) -> None:
    window = safe_window()
    with qtbot.waitSignal(window.session.opened):
        window.files.open(sphere_file)
    with beside(sphere_file, ".ply") as part:
        name = part.name
    stray = sphere_file.with_name(name.replace(f"-{os.getpid()}-", f"-{2**22 + 1}-"))
    stray.write_bytes(b"half")
    after = safe_window()
    qtbot.waitUntil(lambda: not stray.exists())
    assert sphere_file.exists()
    assert after.session.problems.sentence == ""


def test_opening_another_file_keeps_unsaved_work(safe_window, qtbot, sphere_file: Path) -> None:
    window = safe_window()
    work(window, qtbot)
    with qtbot.waitSignal(window.session.opened):
        window.files.open(sphere_file)
    assert "Restore unsaved work" in window.hint.text
    assert window.safety.autosave.flush()
    found = recover(window.safety.autosave.folder, kinds())
    assert [one.why for one in found] == ["set aside"]
    found[0].release()
