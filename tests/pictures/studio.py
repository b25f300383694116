"""Studio: a real window driven with real events, whose stages are kept as pictures."""

from __future__ import annotations

import time
from pathlib import Path

from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import QApplication

from app.window import Window
from resources import sample_path
from tests.app.driving import settled


class Stage:
    """One window and the folder its pictures go to.

    Parameters
    ----------
    window : a window that is shown.
    folder : where pictures are written.
    prefix : before every picture's name.
    """

    def __init__(self, window: Window, folder: Path, prefix: str = "") -> None:
        self.window = window
        self.folder = folder
        self.prefix = prefix
        self.kept: list[Path] = []

    def open(self, sample: str | Path, welcome: bool = False) -> None:
        """Open a sample by name or a file, and wait for it."""
        path = sample if isinstance(sample, Path) else sample_path(sample)
        if welcome:
            self.window.session.opened.connect(
                self.window.welcome.begin, Qt.ConnectionType.SingleShotConnection
            )
        before = self.window.session.document
        self.window.session.open(path)
        self.until(lambda: self.window.session.document is not before)
        self.settle()

    def key(self, action: str) -> None:
        """Trigger an action of the table by its id, as its shortcut would."""
        self.window.actions_table.trigger(action)
        QCoreApplication.processEvents()

    def settle(self) -> None:
        """Wait until the engine rests, all modes are there, and nothing moves."""
        check = settled(self.window)
        self.wait(0.1)
        self.until(lambda: check() and not self.window.session.jobs.busy("decompose"))
        self.wait(0.4)

    def wait(self, seconds: float) -> None:
        """Let the window work for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            QApplication.processEvents()
            time.sleep(0.004)

    def until(self, done: object, seconds: float = 120.0) -> None:
        """Let the window work until `done()` holds.

        Raises
        ------
        TimeoutError
            It did not within the time.
        """
        end = time.monotonic() + seconds
        while not done():  # type: ignore[operator]
            if time.monotonic() > end:
                raise TimeoutError(f"the window did not come to rest after “{self.kept[-1:]}”")
            self.wait(0.02)

    def keep(self, name: str) -> Path:
        """Write a picture of the whole window as it is on the screen."""
        self.wait(0.2)
        path = self.folder / f"{self.prefix}{name}.png"
        handle = self.window.windowHandle()
        shot = handle.screen().grabWindow(self.window.winId())
        if not shot.save(str(path)):
            raise OSError(f"{path} could not be written")
        self.kept.append(path)
        return path
