"""Exceptions nobody caught, native crashes, recovery at the next start, and closing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QObject, QPoint, QSize, Qt, QTimer, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMessageBox, QWidget
from shiboken6 import isValid

from app.crash import CrashDialog, CrashWatch, about, native_crashes
from app.recent import recent
from app.recovery_bar import sentence
from app.window import Window
from engine import Draft, HistoryState, open_archive
from engine.files.place import beside
from engine.journal import recover
from plugins.registry import kinds
from tests.app.driving import picture, settled
from tests.engine.histories import fingerprint

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def watch(qapp, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> Iterator[CrashWatch]:
    """A watch that has taken over the hooks; what it logs is expected."""
    made = CrashWatch(tmp_path / "state")
    made.start()
    yield made
    made.stop()


@pytest.fixture
def safe_window(
    make_window: Callable[..., Window], qtbot, sphere, tmp_path: Path
) -> Iterator[Callable[..., Window]]:
    """Make windows that keep a journal in a state folder; the same for all windows of a test."""
    made: list[Window] = []

    def make(**given) -> Window:
        window = make_window(sphere, **given)
        window.keep_safe(tmp_path / "state")
        # The program plugs safety in before anything is open.
        window.session.take_up(window.session.history, window.session.path)
        qtbot.waitUntil(settled(window))
        made.append(window)
        return window

    yield make
    for window in made:
        if isValid(window):
            window.safety.leave()


def work(window: Window, qtbot) -> HistoryState:
    """Do one step, as a plugin's tool does it, and return the state after it."""
    session = window.session
    roi = np.arange(200, 420)
    session.change(session.document.with_draft(Draft(roi, 0.3)), "Region")
    moved = session.document.mesh.vertices.copy()
    moved[roi] *= 1.01
    step = kinds()["inflate"]
    from engine import UnknownStep

    assert step is not None
    document = session.document.with_step(
        UnknownStep("other", {"roi": roi.tolist()}), session.document.mesh.with_vertices(moved)
    )
    session.change(document, "Step")
    qtbot.waitUntil(settled(window))
    return session.history.state()


def killed(window: Window) -> None:
    """Let go of the journal as a kill of the program does: its bytes are there, its lock is not."""
    scribe = window.safety.autosave._scribe
    assert scribe.flush()
    journal, scribe._journal = scribe._journal, None
    scribe._pusher.soon(journal, journal.abandon)
    assert scribe.flush()


# ---- exceptions


class Clumsy(QObject):
    """Has a slot that fails."""

    @Slot()
    def fail(self) -> None:
        raise ValueError("the slot of a clumsy object")


class ClumsyWidget(QWidget):
    """Fails when it is painted."""

    def paintEvent(self, _event) -> None:
        raise KeyError("the paint event")


def slot() -> None:
    clumsy = Clumsy()
    timer = QTimer()
    timer.timeout.connect(clumsy.fail)
    timer.timeout.emit()


def timer() -> None:
    QTimer.singleShot(0, lambda: [][1])


def thread() -> None:
    def fail() -> None:
        raise RuntimeError("in a thread")

    made = threading.Thread(target=fail)
    made.start()
    made.join(10)


def painting() -> None:
    widget = ClumsyWidget()
    # Shown and drawn by the event loop: an error in a paint that Python asked for goes to Python.
    QTimer.singleShot(0, lambda: widget.show())
    QTimer.singleShot(300, lambda: widget.close())


@pytest.mark.parametrize(
    ("breaks", "words"),
    [
        (slot, "ValueError: the slot of a clumsy object"),
        (timer, "IndexError"),
        (thread, "RuntimeError: in a thread"),
        (painting, "the paint event"),
    ],
)
def test_whatever_fails_is_reported(
    breaks: Callable[[], None], words: str, watch: CrashWatch, qtbot, tmp_path: Path
) -> None:
    with qtbot.waitSignal(watch.crashed, timeout=5000) as caught:
        breaks()
    (report,) = caught.args
    assert words in report
    assert "Traceback" in report
    assert about().splitlines()[1] in report
    kept = next((tmp_path / "state" / "reports").iterdir())
    assert words in kept.read_text(encoding="utf-8")


def test_what_fails_with_every_frame_is_reported_once(
    watch: CrashWatch, qtbot, tmp_path: Path
) -> None:
    reports: list[str] = []
    watch.crashed.connect(reports.append)
    clumsy, timer = Clumsy(), QTimer()
    timer.setInterval(5)
    timer.timeout.connect(clumsy.fail)
    timer.start()
    qtbot.wait(300)
    timer.stop()
    assert len(reports) == 1
    assert len(list((tmp_path / "state" / "reports").iterdir())) == 1


def test_the_hooks_are_given_back(qapp, tmp_path: Path) -> None:
    before = (sys.excepthook, threading.excepthook)
    watch = CrashWatch(tmp_path)
    watch.start()
    assert sys.excepthook != before[0]
    watch.stop()
    assert (sys.excepthook, threading.excepthook) == before
    assert list(tmp_path.glob("native-*")) == []


def test_the_crash_window_has_a_sentence_a_save_and_a_report(qtbot, qapp, artefacts: Path) -> None:
    saves: list[int] = []
    dialog = CrashDialog("the report\nTraceback: x", lambda: saves.append(1))
    qtbot.addWidget(dialog)
    dialog.show()
    assert not dialog.isModal()
    assert "Traceback" not in dialog.sentence
    dialog.grab().save(str(artefacts / "crash.png"))
    qtbot.mouseClick(dialog.copy, Qt.MouseButton.LeftButton)
    assert QGuiApplication.clipboard().text() == "the report\nTraceback: x"
    qtbot.mouseClick(dialog.save, Qt.MouseButton.LeftButton)
    assert saves == [1]
    dialog.add("a second one")
    assert "2 times" in dialog.sentence
    assert "a second one" in dialog.report
    qtbot.mouseClick(dialog.look, Qt.MouseButton.LeftButton)
    dialog.grab().save(str(artefacts / "crash with report.png"))
    qtbot.mouseClick(dialog.go_on, Qt.MouseButton.LeftButton)


def test_a_failing_slot_leaves_the_window_usable(
    safe_window, qtbot, caplog: pytest.LogCaptureFixture, tmp_path: Path, monkeypatch
) -> None:
    window = safe_window()
    state = work(window, qtbot)
    with qtbot.waitSignal(window.safety.watch.crashed):
        QTimer.singleShot(0, lambda: [][1])
    qtbot.waitUntil(lambda: window.safety._dialog is not None)
    dialog = window.safety._dialog
    with qtbot.waitSignal(window.safety.watch.crashed):
        QTimer.singleShot(0, lambda: {}["other"])
    assert window.safety._dialog is dialog
    assert "2 times" in dialog.sentence
    copy = tmp_path / "copy.eigenform"
    monkeypatch.setattr(window.documents, "ask_path", lambda: copy)
    qtbot.mouseClick(dialog.save, Qt.MouseButton.LeftButton)
    assert copy.exists(), "saved at once, whatever the engine does"
    assert fingerprint(open_archive(copy, kinds()).state) == fingerprint(state)
    assert window.safety.autosave.worth_asking, "a copy is not the document"
    dialog.close()
    qtbot.waitUntil(lambda: window.safety._dialog is None)
    window.session.undo()
    assert window.session.history.can_redo


def test_a_bug_in_the_engine_thread_is_reported_too(
    safe_window, qtbot, caplog: pytest.LogCaptureFixture
) -> None:
    window = safe_window()
    session = window.session
    document = session.document

    def work(_run) -> None:
        raise ZeroDivisionError("deep in the engine")

    with qtbot.waitSignal(window.safety.watch.crashed) as caught:
        session.jobs.submit("apply", work, lambda _result: None, session.problems.report)
    assert "deep in the engine" in caught.args[0]
    assert "in work" in caught.args[0], "the report says where"
    assert session.document is document
    qtbot.waitUntil(lambda: window.safety._dialog is not None)
    window.safety._dialog.close()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_native_crash_is_told_at_the_next_start(tmp_path: Path) -> None:
    program = (
        "import sys, os, signal; from pathlib import Path\n"
        "from PySide6.QtCore import QCoreApplication\n"
        "from app.crash import CrashWatch\n"
        "app = QCoreApplication([])\n"
        "watch = CrashWatch(Path(sys.argv[1])); watch.start()\n"
        "def deep(): os.kill(os.getpid(), getattr(signal, sys.argv[2]))\n"
        "deep()\n"
    )
    for name in ("SIGSEGV", "SIGABRT", "SIGKILL"):
        done = subprocess.run(
            [sys.executable, "-c", program, str(tmp_path), name],
            cwd=ROOT,
            timeout=30,
            check=False,
        )
        assert done.returncode == -getattr(signal, name)
    for log in tmp_path.glob("native-*.log"):
        os.utime(log, (0, 0))
    segfault, abort = sorted(native_crashes(tmp_path), key=lambda text: "Aborted" in text)
    assert "Segmentation fault" in segfault
    assert "in deep" in segfault
    assert "Aborted" in abort
    assert native_crashes(tmp_path) == []
    assert list(tmp_path.glob("native-*")) == []


def test_a_running_program_keeps_its_crash_log(watch: CrashWatch, tmp_path: Path) -> None:
    for log in (tmp_path / "state").glob("native-*.log"):
        os.utime(log, (0, 0))
    assert native_crashes(tmp_path / "state") == []
    assert len(list((tmp_path / "state").glob("native-*.log"))) == 1


# ---- recovery


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


# ---- saving and closing


def test_save_and_open_again(safe_window, qtbot, tmp_path: Path, monkeypatch) -> None:
    window = safe_window()
    state = work(window, qtbot)
    assert window.isWindowModified()
    path = tmp_path / "mein Käfer"
    monkeypatch.setattr(
        "app.documents.QFileDialog.getSaveFileName", lambda *_given: (str(path), "")
    )
    with qtbot.waitSignal(window.documents.saved):
        window.actions_table.trigger("file.save")
    written = path.with_name("mein Käfer.eigenform")
    assert window.documents.path == written
    assert not window.isWindowModified()
    assert not window.safety.autosave.unsaved
    assert window.windowTitle().startswith("mein Käfer.eigenform")
    assert recent() == [written]
    eye = window.viewport.eye
    window.viewport.turn_by(0.7, 0.1)
    window.session.undo()
    window.session.undo()
    with qtbot.waitSignal(window.files.unpacked):
        window.files.open(written)
    qtbot.waitUntil(settled(window))
    assert fingerprint(window.session.history.state()) == fingerprint(state)
    assert window.viewport.eye.same_as(eye)
    assert not window.safety.autosave.unsaved
    with qtbot.waitSignal(window.documents.saved):
        window.actions_table.trigger("file.save")
    assert window.session.problems.sentence == ""


def test_a_damaged_document_is_not_saved_over(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    work(window, qtbot)
    path = tmp_path / "a.eigenform"
    with qtbot.waitSignal(window.documents.saved):
        window.documents.save_to(path)
    path.write_bytes(path.read_bytes()[:-2000])
    with qtbot.waitSignal(window.files.unpacked):
        window.files.open(path)
    assert "damaged" in window.session.problems.sentence
    assert window.documents.path is None


def test_a_document_that_cannot_be_opened_leaves_the_old_one(
    safe_window, qtbot, tmp_path: Path
) -> None:
    window = safe_window()
    document = window.session.document
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    window.files.open(path)
    qtbot.waitUntil(lambda: bool(window.session.problems.sentence))
    assert "a.eigenform" in window.session.problems.sentence
    assert window.session.document is document


def answer(window: Window, qtbot, button: QMessageBox.StandardButton) -> None:
    qtbot.waitUntil(lambda: window.safety._question is not None)
    question = window.safety._question
    qtbot.mouseClick(question.button(button), Qt.MouseButton.LeftButton)


def test_closing_with_work_asks_and_cancel_stays(safe_window, qtbot, artefacts: Path) -> None:
    window = safe_window()
    work(window, qtbot)
    assert not window.close()
    window.safety._question.grab().save(str(artefacts / "question.png"))
    answer(window, qtbot, QMessageBox.StandardButton.Cancel)
    assert window.isVisible()
    window.session.undo()
    window.session.redo()


def test_not_saving_sets_the_work_aside(safe_window, qtbot, sphere) -> None:
    window = safe_window()
    state = work(window, qtbot)
    folder = window.safety.autosave.folder
    assert not window.close()
    answer(window, qtbot, QMessageBox.StandardButton.Discard)
    (aside,) = recover(folder, kinds())
    aside.release()
    assert aside.why == "set aside"
    after = safe_window()
    with qtbot.waitSignal(after.safety.looked):
        pass
    assert not after.safety.bar.isVisible(), "the next start says nothing of it"
    after.actions_table.trigger("file.restore")
    qtbot.waitUntil(lambda: after.safety.bar.isVisible())
    assert "closed without saving" in after.safety.bar.text
    after.safety.bar.buttons["Restore"].click()
    assert fingerprint(after.session.history.state()) == fingerprint(state)


def test_saving_on_closing_closes_afterwards(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    state = work(window, qtbot)
    path = tmp_path / "a.eigenform"
    window.documents.ask_path = lambda: path
    assert not window.close()
    closed: list[int] = []
    window.destroyed.connect(lambda: closed.append(1))
    answer(window, qtbot, QMessageBox.StandardButton.Save)
    qtbot.waitUntil(lambda: bool(closed))
    assert fingerprint(open_archive(path, kinds()).state) == fingerprint(state)
    assert recover(tmp_path / "state" / "journals", kinds()) == []


def test_a_draft_alone_is_closed_without_a_word(safe_window, qtbot, tmp_path: Path) -> None:
    window = safe_window()
    session = window.session
    session.change(session.document.with_draft(Draft(np.arange(200, 420), 0.3)), "Region")
    assert window.safety.autosave.unsaved
    assert window.close()
    (aside,) = recover(tmp_path / "state" / "journals", kinds())
    assert aside.why == "set aside"
    aside.release()


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
    with qtbot.waitSignal(window.session.opened, timeout=30_000):
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
    with qtbot.waitSignal(window.session.opened, timeout=30_000):
        window.files.open(sphere_file)
    assert "Restore unsaved work" in window.hint.text
    assert window.safety.autosave.flush()
    found = recover(window.safety.autosave.folder, kinds())
    assert [one.why for one in found] == ["set aside"]
    found[0].release()
