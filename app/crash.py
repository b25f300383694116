"""When something of ours breaks: one window with a sentence, a way to save, and a report to copy.

An exception in a slot, a timer, a paint event or a thread ends nothing: the document is frozen and
stays as it was. A native crash ends the program; what faulthandler wrote of it is shown at the next
start.
"""

from __future__ import annotations

import contextlib
import faulthandler
import logging
import os
import platform
import secrets
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from PySide6.QtCore import QObject, Qt, Signal, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from engine.filelock import try_lock

log = logging.getLogger(__name__)

NATIVE = "native-*.log"
KEPT_LINES = 60
KEPT_REPORTS = 20
SAME_SECONDS = 2.0
LONGEST = 100_000
"""Characters of a report: the message of an error may hold a whole array."""
PACKAGES = ("eigenform", "PySide6-Essentials", "vtk", "pyvista", "pyvistaqt", "numpy", "scipy")


class CrashWatch(QObject):
    """Catches what nobody caught.

    Parameters
    ----------
    folder : the state folder; native crashes and reports are written there.

    Signals
    -------
    crashed(report) : an exception reached the top; emitted in the window's thread.
    """

    crashed = Signal(str)
    _caught = Signal(str)

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._lines = _LastLines()
        self._native: BinaryIO | None = None
        self._native_path: Path | None = None
        self._watched_before = False
        self._latest = ("", 0.0)
        self._before: tuple[Any, Any] | None = None
        self._caught.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Take over the hooks of exceptions and of native crashes."""
        self._before = (sys.excepthook, threading.excepthook)
        sys.excepthook = self._exception
        threading.excepthook = self._thread_exception
        logging.getLogger().addHandler(self._lines)
        with contextlib.suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            name = f"native-{os.getpid()}-{secrets.token_hex(4)}.log"
            self._native_path = self._folder / name
            self._native = self._native_path.open("xb", buffering=0)
            try_lock(self._native)
            self._watched_before = faulthandler.is_enabled()
            faulthandler.enable(self._native, all_threads=True)

    def stop(self) -> None:
        """Give the hooks back; the program ends as it should."""
        if self._before is not None:
            sys.excepthook, threading.excepthook = self._before
            self._before = None
        logging.getLogger().removeHandler(self._lines)
        if self._native is not None and self._native_path is not None:
            faulthandler.disable()
            if self._watched_before and sys.__stderr__ is not None:
                faulthandler.enable(sys.__stderr__)
            self._native.close()
            self._native_path.unlink(missing_ok=True)
            self._native = None

    def note(self, error: BaseException) -> None:
        """Report an error that was caught where it could not be mended."""
        self._exception(type(error), error, error.__traceback__)

    def _exception(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
            return
        try:
            self._report(kind, error, trace)
        except Exception as second:  # noqa: BLE001
            # Nothing catches what fails in here; both are at least printed.
            sys.__excepthook__(kind, error, trace)
            sys.__excepthook__(type(second), second, second.__traceback__)

    def _report(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        text = _printable("".join(traceback.format_exception(kind, error, trace)))
        before, self._latest = self._latest, (text, time.monotonic())
        if before[0] == text and self._latest[1] - before[1] < SAME_SECONDS:
            return  # a paint event fails again with every frame: once is enough
        log.error("Nobody caught this:\n%s", text)
        report = f"{about()}\n{text}\nLast log lines:\n{_printable(self._lines.text)}"
        self._keep(report)
        self._caught.emit(report)

    def _thread_exception(self, given: threading.ExceptHookArgs) -> None:
        if given.exc_value is not None and not issubclass(given.exc_type, SystemExit):
            self._exception(given.exc_type, given.exc_value, given.exc_traceback)

    def _keep(self, report: str) -> None:
        with contextlib.suppress(OSError):
            folder = self._folder / "reports"
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            name = f"{time.strftime('%Y%m%d-%H%M%S')}-{secrets.token_hex(4)}.txt"
            (folder / name).write_text(report, encoding="utf-8")
            for old in sorted(folder.glob("*.txt"))[:-KEPT_REPORTS]:
                old.unlink(missing_ok=True)

    @Slot(str)
    def _deliver(self, report: str) -> None:
        self.crashed.emit(report)


class _LastLines(logging.Handler):
    """Keeps the last lines of the log for a report."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._kept: deque[str] = deque(maxlen=KEPT_LINES)

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self._kept.append(f"{record.levelname} {record.name}: {record.getMessage()}"[:500])
        except Exception:  # noqa: BLE001
            # A line that cannot be put together must not stop the work that it is about.
            self.handleError(record)

    @property
    def text(self) -> str:
        """The lines, oldest first."""
        return "\n".join(self._kept)


def _printable(text: str) -> str:
    """Return a text that can be written and copied: shortened in its middle, and all in UTF-8."""
    text = text.encode("utf-8", "backslashreplace").decode()
    if len(text) <= LONGEST:
        return text
    return f"{text[: LONGEST // 2]}\n… cut …\n{text[-LONGEST // 2 :]}"


def about() -> str:
    """Return versions of everything a report needs, and nothing of the person's own."""
    lines = [
        f"{platform.system()} {platform.release()} {platform.machine()}",
        f"Python {platform.python_version()}",
    ]
    for name in PACKAGES:
        try:
            lines.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            lines.append(f"{name} not installed as a package")
    return "\n".join(lines) + "\n"


def native_crashes(folder: Path) -> list[str]:
    """Return what faulthandler wrote in earlier runs that crashed, and remove the files.

    Files of running programs are left; empty ones are of runs that were killed from outside.
    """
    found: list[str] = []
    for path in sorted(folder.glob(NATIVE)):
        if not os.path.isfile(path):  # noqa: PTH113
            # Path.is_file raises where a folder may not be entered; a pipe would never answer.
            continue
        with contextlib.suppress(OSError):
            with path.open("r+b") as file:
                if try_lock(file) is not True:
                    continue
                text = file.read(100_000).decode("utf-8", "replace").strip()
            if not text and time.time() - path.stat().st_mtime < 60:
                # A program that has just begun may not have locked its file yet.
                continue
            if text:
                found.append(f"{about()}\n{text}")
            path.unlink()
    return found


class CrashDialog(QDialog):
    """Says in one sentence what happened; everything else is one button away.

    Parameters
    ----------
    report : what "Copy report" copies.
    save : saves the document under another name; None when nothing is open.
    """

    def __init__(
        self, report: str, save: Callable[[], object] | None, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle("Something went wrong")
        self.setModal(False)
        self._reports = [report]
        self._sentence = QLabel(self)
        self._sentence.setWordWrap(True)
        self._details = QPlainTextEdit(self)
        self._details.setReadOnly(True)
        self._details.setAccessibleName("Report")
        self._details.hide()
        self.save = QPushButton("Save a copy…", self)
        self.save.setEnabled(save is not None)
        if save is not None:
            self.save.clicked.connect(lambda: save())
        self.copy = QPushButton("Copy report", self)
        self.copy.clicked.connect(self._copy)
        self.look = QPushButton("Show report", self)
        self.look.clicked.connect(self._look)
        self.go_on = QPushButton("Continue", self)
        self.go_on.setDefault(True)
        self.go_on.clicked.connect(self.close)
        row = QHBoxLayout()
        row.setSpacing(8)
        for button in (self.look, self.copy):
            row.addWidget(button)
        row.addStretch(1)
        row.addWidget(self.save)
        row.addWidget(self.go_on)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 16, 16, 16)
        column.setSpacing(16)
        column.addWidget(self._sentence)
        column.addWidget(self._details, 1)
        column.addLayout(row)
        self.setMinimumWidth(520)
        self._say()

    @property
    def report(self) -> str:
        """Everything that happened since the window was opened."""
        return "\n\n".join(self._reports)

    @property
    def sentence(self) -> str:
        """What the person reads."""
        return self._sentence.text()

    def add(self, report: str) -> None:
        """Something more went wrong while this window is open."""
        if len(self._reports) < KEPT_REPORTS:
            self._reports.append(report)
        self._say()

    def _say(self) -> None:
        often = "" if len(self._reports) == 1 else f" ({len(self._reports)} times)"
        self._sentence.setText(
            f"Something in Eigenform failed that should not have{often}. Your work is as it was "
            "before, and a recovery copy is kept. You can go on; to be sure, save a copy. "
            "With the report we can mend it."
        )
        self._details.setPlainText(self.report)

    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self.report)
        self.copy.setText("Copied")

    def _look(self) -> None:
        shown = not self._details.isVisible()
        self._details.setVisible(shown)
        self.look.setText("Hide report" if shown else "Show report")
        if shown:
            self.resize(max(self.width(), 760), 480)
        else:
            self.adjustSize()
