"""The engine thread: one worker that computes, reports, is cancelled, and where the newest wins.

Work is submitted to a *channel*. A new job in a channel cancels the one before it. Urgent work (a
stroke that moves) is done between two ticks of slow work (modes), so that the surface follows the
hand while modes still stream in. Results cross to the window's thread once, by a queued signal.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal, Slot

from engine import Cancelled, EngineError, Memo, Run

log = logging.getLogger(__name__)

Work = Callable[[Run], Any]
PROGRESS_INTERVAL = 0.05  # seconds between two progress signals: more only costs repaints


@dataclass(eq=False)
class Job:
    """One piece of work.

    Parameters
    ----------
    channel : jobs of the same channel replace each other.
    work : called in the engine thread; if it returns a generator, each item is delivered.
    done : called in the window's thread with every result.
    failed : called in the window's thread with the error.
    priority : lower goes first.
    urgent : may be done in the middle of a job of higher priority number; it must not share
        unfinished work with other jobs.
    overtakable : a newer job replaces it only while it waits; once it runs it is finished and
        delivered, so that a hand that moves faster than the engine still sees the form follow.
    finished : called in the window's thread when no more results will come (not when cancelled).
    """

    channel: str
    work: Work
    done: Callable[[Any], None]
    failed: Callable[[Exception], None]
    priority: int = 5
    urgent: bool = False
    overtakable: bool = False
    finished: Callable[[], None] | None = None
    run: Run = field(default_factory=Run)
    stream: Generator[Any, None, None] | None = None
    last_report: float = 0.0


class Jobs(QObject):
    """Runs jobs one at a time in a thread of its own.

    Signals
    -------
    progressed(channel, fraction, text) : a job reports; at most twenty times a second.
    idled(channel) : the channel has nothing more to do.
    """

    progressed = Signal(str, float, str)
    idled = Signal(str)
    _delivered = Signal(object, str, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.memo = Memo(12)
        self._newest: dict[str, Job] = {}
        self._overtaken: list[Job] = []
        self._waiting: list[Job] = []
        self._wake = threading.Condition()
        self._stopping = False
        self._delivered.connect(self._deliver, Qt.ConnectionType.QueuedConnection)
        self._thread = threading.Thread(target=self._serve, name="engine", daemon=True)
        self._thread.start()

    def submit(
        self,
        channel: str,
        work: Work,
        done: Callable[[Any], None],
        failed: Callable[[Exception], None],
        *,
        priority: int = 5,
        urgent: bool = False,
        overtakable: bool = False,
        finished: Callable[[], None] | None = None,
    ) -> Job:
        """Queue `work`; it takes the place of whatever waits or runs in the same channel."""
        job = Job(channel, work, done, failed, priority, urgent, overtakable, finished)
        job.run = Run(lambda fraction, text: self._ticked(job, fraction, text), self.memo)
        with self._wake:
            before = self._newest.get(channel)
            if before is not None and before.overtakable and before not in self._waiting:
                self._overtaken.append(before)
            else:
                self._cancel(channel)
            self._newest[channel] = job
            self._waiting.append(job)
            self._wake.notify()
        return job

    def cancel(self, channel: str) -> None:
        """Stop what waits or runs in a channel; its results are not delivered any more."""
        with self._wake:
            had = self._newest.get(channel)
            self._cancel(channel)
            for job in [one for one in self._overtaken if one.channel == channel]:
                job.run.cancel()
                self._overtaken.remove(job)
        if had is not None:
            self.idled.emit(channel)

    def busy(self, channel: str) -> bool:
        """Whether a channel waits or runs."""
        return channel in self._newest

    def stop(self, seconds: float = 5.0) -> None:
        """Cancel everything and wait for the thread to end."""
        with self._wake:
            for channel in list(self._newest):
                self._cancel(channel)
            self._stopping = True
            self._wake.notify()
        self._thread.join(seconds)

    def _cancel(self, channel: str) -> None:
        job = self._newest.pop(channel, None)
        if job is None:
            return
        job.run.cancel()
        if job in self._waiting:
            self._waiting.remove(job)

    # ---- engine thread

    def _serve(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._stopping or self._waiting)
                if self._stopping:
                    return
                job = self._take()
            if job is not None:
                self._advance(job)

    def _take(self, urgent_below: int | None = None) -> Job | None:
        """Remove and return the first job in line; with `urgent_below` only an urgent one."""
        with self._wake:
            able = [
                job
                for job in self._waiting
                if urgent_below is None or (job.urgent and job.priority < urgent_below)
            ]
            if not able:
                return None
            job = min(able, key=lambda one: one.priority)
            self._waiting.remove(job)
            return job

    def _advance(self, job: Job) -> None:
        """Do one job, or one item of a stream; an unfinished stream goes back in line."""
        try:
            if job.stream is None:
                result = job.work(job.run)
                if not isinstance(result, Generator):
                    self._delivered.emit(job, "last", result)
                    return
                job.stream = result
            item = next(job.stream)
        except StopIteration:
            self._delivered.emit(job, "end", None)
            return
        except Cancelled:
            self._delivered.emit(job, "cancelled", None)
            return
        except EngineError as error:
            self._delivered.emit(job, "error", error)
            return
        except Exception as error:  # a bug must reach the person as a sentence, not end the thread
            log.exception("A job in the channel %s failed", job.channel)
            self._delivered.emit(job, "error", error)
            return
        self._delivered.emit(job, "item", item)
        with self._wake:
            if not job.run.cancelled:
                self._waiting.append(job)
            else:
                job.stream.close()

    def _ticked(self, job: Job, fraction: float, text: str) -> None:
        """Report progress and let urgent work in; called by the engine, often."""
        now = time.monotonic()
        if now - job.last_report >= PROGRESS_INTERVAL:
            job.last_report = now
            self.progressed.emit(job.channel, float(fraction), text)
        while (other := self._take(urgent_below=job.priority)) is not None:
            self._advance(other)

    # ---- window's thread

    @Slot(object, str, object)
    def _deliver(self, job: Job, kind: str, payload: Any) -> None:
        if job in self._overtaken:
            self._overtaken.remove(job)
            if kind == "last":
                job.done(payload)
            return
        if self._newest.get(job.channel) is not job:
            return  # a newer job has taken its place: this result is late
        if kind in ("last", "end", "error", "cancelled"):
            del self._newest[job.channel]
        if kind in ("last", "item"):
            job.done(payload)
        elif kind == "error":
            job.failed(payload)
        if kind in ("last", "end") and job.finished is not None:
            job.finished()
        if kind != "item" and job.channel not in self._newest:
            self.idled.emit(job.channel)
