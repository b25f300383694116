"""Writing: files written in the background, every one of them to its end."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal

from app.jobs import Jobs
from engine import Run
from engine.files.report import shown

T = TypeVar("T")


class Writing(QObject):
    """Writes files in the engine's thread; neither opening a file nor another one stops it.

    Signals
    -------
    settled(well) : nothing is being written any more; whether all of it could be written.
    """

    settled = Signal(bool)

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._numbers = count(1)
        self._under_way: dict[str, Path] = {}
        self._well = True

    @property
    def busy(self) -> bool:
        """Whether anything waits to be written or is being written."""
        return bool(self._under_way)

    @property
    def names(self) -> str:
        """The files that are not done yet, for a sentence."""
        return ", ".join(dict.fromkeys(shown(path.name) for path in self._under_way.values()))

    def write(
        self,
        path: Path,
        work: Callable[[Run], T],
        done: Callable[[T], None],
        failed: Callable[[Exception], None],
        *,
        urgent: bool = False,
    ) -> None:
        """Have `work` write a file in the background.

        Parameters
        ----------
        done, failed : called in this thread with what `work` returned or raised.
        urgent : do it between two ticks of a long computation rather than after it.
        """
        channel = f"write {next(self._numbers)}"
        self._under_way[channel] = path

        def written(result: T) -> None:
            del self._under_way[channel]
            done(result)
            self._settle()

        def not_written(error: Exception) -> None:
            del self._under_way[channel]
            self._well = False
            failed(error)
            self._settle()

        priority = 0 if urgent else 1
        self._jobs.submit(channel, work, written, not_written, priority=priority, urgent=urgent)

    def cancel(self) -> None:
        """Write nothing more; what stood in the files before stays whole."""
        for channel in list(self._under_way):
            del self._under_way[channel]
            self._jobs.cancel(channel, asked=True)
            self._well = False
        self._settle()

    def _settle(self) -> None:
        if not self._under_way:
            well, self._well = self._well, True
            self.settled.emit(well)
