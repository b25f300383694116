"""Exceptions nobody caught and native crashes: reported, and the window stays usable."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QObject, Qt, QTimer, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget

from app import crash
from app.crash import CrashDialog, CrashWatch, about, native_crashes
from engine import open_archive
from plugins.registry import kinds
from tests.app.safe import work
from tests.engine.histories import fingerprint
from tests.program import run_python

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def watch(qapp, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> Iterator[CrashWatch]:
    """A watch that has taken over the hooks; what it logs is expected."""
    made = CrashWatch(tmp_path / "state")
    made.start()
    yield made
    made.stop()


class Clumsy(QObject):
    """Has a slot that fails."""

    @Slot()
    def fail(self) -> None:
        raise ValueError("the slot of a clumsy object")


class ClumsyWidget(QWidget):
    """Fails when it is painted, and goes."""

    def paintEvent(self, _event) -> None:
        QTimer.singleShot(0, self.close)
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
    made.join()


def painting() -> QWidget:
    widget = ClumsyWidget()
    # Shown and drawn by the event loop: an error in a paint that Python asked for goes to Python.
    QTimer.singleShot(0, widget.show)
    return widget


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
    breaks: Callable[[], QWidget | None], words: str, watch: CrashWatch, qtbot, tmp_path: Path
) -> None:
    with qtbot.waitSignal(watch.crashed) as caught:
        _shown = breaks()
    (report,) = caught.args
    assert words in report
    assert "Traceback" in report
    assert about().splitlines()[1] in report
    kept = next((tmp_path / "state" / "reports").iterdir())
    assert words in kept.read_text(encoding="utf-8")


def test_what_fails_with_every_frame_is_reported_once(
    watch: CrashWatch, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(crash, "SAME_SECONDS", 1e9)
    reports: list[str] = []
    watch.crashed.connect(reports.append)
    clumsy, timer = Clumsy(), QTimer()
    timer.setInterval(5)
    frames: list[int] = []
    timer.timeout.connect(lambda: frames.append(1))
    timer.timeout.connect(clumsy.fail)
    timer.start()
    qtbot.waitUntil(lambda: len(frames) >= 30)
    timer.stop()
    assert len(reports) == 1
    assert len(list((tmp_path / "state" / "reports").iterdir())) == 1


def fail_again() -> None:
    try:
        raise ValueError("again")
    except ValueError:
        sys.excepthook(*sys.exc_info())


def test_what_fails_again_after_a_while_is_reported_again(
    watch: CrashWatch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = tmp_path / "state" / "reports"
    monkeypatch.setattr(crash, "SAME_SECONDS", 1e9)
    for _ in range(2):
        fail_again()
    assert len(list(written.iterdir())) == 1, "not yet"
    monkeypatch.setattr(crash, "SAME_SECONDS", 0.0)
    fail_again()
    assert len(list(written.iterdir())) == 2


def test_a_report_holds_what_was_logged_before(watch: CrashWatch, tmp_path: Path) -> None:
    logging.getLogger("app.somewhere").warning("the disk is nearly full")
    fail_again()
    (report,) = (tmp_path / "state" / "reports").iterdir()
    before, last = report.read_text(encoding="utf-8").split("Last log lines:")
    assert before.startswith(about())
    assert "ValueError: again" in before
    assert "the disk is nearly full" in last


class Unspeakable(Exception):
    """Cannot be put into words."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (Unspeakable(), "Unspeakable"),
        (OSError(2, "gone", "a name of no text \udcff"), "a name of no text"),
        (ValueError("x" * 5_000_000 + " and its end"), "and its end"),
    ],
    ids=["no words", "no text", "no end"],
)
def test_an_error_that_is_hard_to_tell_is_reported_too(
    error: Exception, words: str, watch: CrashWatch, qtbot, tmp_path: Path
) -> None:
    with qtbot.waitSignal(watch.crashed) as caught:
        watch.note(error)
    (report,) = caught.args
    assert words in report
    assert len(report) < 300_000
    assert words in next((tmp_path / "state" / "reports").iterdir()).read_text(encoding="utf-8")


def test_what_fails_inside_the_hook_is_printed(
    watch: CrashWatch, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_report: str) -> None:
        raise RuntimeError("in the hook itself")

    monkeypatch.setattr(watch, "_keep", fail)
    watch.note(ValueError("the first one"))
    printed = capsys.readouterr().err
    assert "the first one" in printed
    assert "in the hook itself" in printed


def test_a_log_line_that_cannot_be_put_together_stops_nothing(
    watch: CrashWatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging, "raiseExceptions", False)
    watch._lines.handle(logging.makeLogRecord({"msg": "%d modes", "args": ("none",)}))
    watch._lines.handle(logging.makeLogRecord({"msg": "the next one"}))
    assert watch._lines.text.endswith("the next one")


@pytest.mark.skipif(sys.platform == "win32", reason="it has no mkfifo")
def test_a_damaged_crash_log_delays_nothing(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "native-1-a.log")
    (tmp_path / "native-2-b.log").mkdir()
    (tmp_path / "native-3-c.log").symlink_to("native-3-c.log")
    (tmp_path / "native-4-d.log").write_bytes(b"Fatal \xff\x00" + bytes(range(256)) * 4000)
    (told,) = native_crashes(tmp_path)
    assert "Fatal" in told
    assert len(told) < 200_000


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
        done = run_python("-c", program, str(tmp_path), name, cwd=tmp_path)
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
