"""The engine thread: one worker that computes, reports, is cancelled, and where the newest wins.

Work is submitted to a *channel*. A new job in a channel cancels the one before it. Urgent work (a
stroke that moves) is done between two ticks of slow work (modes), so that the surface follows the
hand while modes still stream in. Results cross to the window's thread once, by a queued signal.
"""

from __future__ import annotations

import logging
import threading
import time
import weakref
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot

from engine import Cancelled, EngineError, Memo, Run
from plugins.interruption import InterruptibleThread

log = logging.getLogger(__name__)

Work = Callable[[Run], Any]
SILENCE = 60.0  # seconds without a tick: work that is not ours has hung
GRACE = 2.0  # seconds that work may take to end when the person cancels it
LOOK_MS = 250
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
    stuck : for work that is not ours. When it gives no sign of life for `SILENCE` seconds, or does
        not end within `GRACE` seconds after the person cancelled it, it is left behind: the engine
        goes on in a fresh thread, and this is called in the window's thread with the seconds since
        its last sign.
    """

    channel: str
    work: Work
    done: Callable[[Any], None]
    failed: Callable[[Exception], None]
    priority: int = 5
    urgent: bool = False
    overtakable: bool = False
    finished: Callable[[], None] | None = None
    stuck: Callable[[float], None] | None = None
    run: Run = field(default_factory=Run)
    stream: Generator[Any, None, None] | None = None
    last_report: float = 0.0
    alive: float = 0.0
    told: float = 0.0
    worker: Worker | None = None


class Worker:
    """A thread that computes, and the jobs that it is in: an urgent one inside a slow one."""

    def __init__(self, serve: Callable[[Worker], None]) -> None:
        self.inside: list[Job] = []
        self.left = False
        self.thread = InterruptibleThread("engine", lambda: serve(self))


class Jobs(QObject):
    """Runs jobs one at a time in a thread of its own.

    Signals
    -------
    began(channel) : a channel that had nothing to do has work.
    progressed(channel, fraction, text) : a job reports; at most twenty times a second.
    idled(channel) : the channel has nothing more to do.
    """

    began = Signal(str)
    progressed = Signal(str, float, str)
    idled = Signal(str)
    _delivered = Signal(object, str, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.memo = Memo(12)
        self._newest: dict[str, Job] = {}
        self._overtaken: list[Job] = []
        self._waiting: list[Job] = []
        self._broken_off: list[Job] = []
        self._wake = threading.Condition()
        self._stopping = False
        self._delivered.connect(self._deliver, Qt.ConnectionType.QueuedConnection)
        self._look = QTimer(self)
        self._look.setInterval(LOOK_MS)
        self._look.timeout.connect(self._look_after)
        self._worker = Worker(self._serve)
        self._worker.thread.start()

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
        stuck: Callable[[float], None] | None = None,
    ) -> Job:
        """Queue `work`; it takes the place of whatever waits or runs in the same channel."""
        job = Job(channel, work, done, failed, priority, urgent, overtakable, finished, stuck)
        job.run = Run(self._reporter(job), self.memo)
        with self._wake:
            before = self._newest.get(channel)
            if before is not None and before.overtakable and before not in self._waiting:
                self._overtaken.append(before)
            else:
                self._cancel(channel)
            self._newest[channel] = job
            self._waiting.append(job)
            self._wake.notify()
        if stuck is not None and not self._look.isActive():
            self._look.start()
        if before is None:
            self.began.emit(channel)
        return job

    def _reporter(self, job: Job) -> Callable[[float, str], None]:
        """Return what the run of a job reports to.

        It does not hold the job, which holds the run: what the job was made for, and what it made,
        goes with it, not when the collector next comes.
        """
        its = weakref.ref(job)

        def report(fraction: float, text: str) -> None:
            working = its()
            if working is not None:
                self._ticked(working, fraction, text)

        return report

    def cancel(self, channel: str, *, asked: bool = False) -> None:
        """Stop what waits or runs in a channel; its results are not delivered any more.

        Parameters
        ----------
        asked : the person asked for it, so work that does not listen is left behind soon.
        """
        with self._wake:
            had = self._newest.get(channel)
            if had is not None and asked:
                had.told = time.monotonic()
            self._cancel(channel)
            for job in [one for one in self._overtaken if one.channel == channel]:
                job.run.cancel()
                job.told = time.monotonic() if asked else 0.0
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
        self._look.stop()
        self._worker.thread.join(seconds)
        if self._worker.thread.is_alive():
            self._worker.thread.interrupt()

    def _cancel(self, channel: str) -> None:
        job = self._newest.pop(channel, None)
        if job is None:
            return
        job.run.cancel()
        if job in self._waiting:
            self._waiting.remove(job)
            if job.stream is not None:
                self._broken_off.append(job)
                self._wake.notify()

    # ---- work that hangs

    def _look_after(self) -> None:
        """Leave work behind that does not end although it should."""
        with self._wake:
            inside = list(self._worker.inside)
        now = time.monotonic()
        if not any(job.stuck for job in [*inside, *self._waiting]):
            self._look.stop()
        if not inside or inside[-1].stuck is None:
            return
        job = inside[-1]
        silent = now - job.alive
        if silent > SILENCE or (job.told and now - job.told > GRACE):
            self._leave_behind(inside, silent)

    def _leave_behind(self, inside: list[Job], silent: float) -> None:
        """Go on in a fresh thread; what the hung job had interrupted begins again there."""
        *interrupted, hung = inside
        log.info("A job in the channel %s, silent for %.0f s, is left behind", hung.channel, silent)
        with self._wake:
            left, self._worker = self._worker, Worker(self._serve)
            left.left = True
            for job in inside:
                job.run.cancel()
            again = [job for job in interrupted if self._newest.get(job.channel) is job]
            current = self._newest.get(hung.channel) is hung
            if current:
                del self._newest[hung.channel]
            if hung in self._overtaken:
                self._overtaken.remove(hung)
        left.thread.interrupt()
        self._worker.thread.start()
        for job in again:
            self.submit(
                job.channel,
                job.work,
                job.done,
                job.failed,
                priority=job.priority,
                urgent=job.urgent,
                overtakable=job.overtakable,
                finished=job.finished,
                stuck=job.stuck,
            )
        assert hung.stuck is not None
        hung.stuck(silent)
        if current:
            self.idled.emit(hung.channel)

    # ---- engine thread

    def _serve(self, worker: Worker) -> None:
        while self._serve_one(worker):
            pass  # between two jobs nothing is held of the one before

    def _serve_one(self, worker: Worker) -> bool:
        """Wait for one job and do it; return whether the thread goes on."""
        with self._wake:
            self._wake.wait_for(
                lambda: self._stopping or worker.left or self._waiting or self._broken_off
            )
            if worker.left:
                return False
            broken_off = self._broken_off.pop() if self._broken_off else None
            if broken_off is None and self._stopping:
                return False
            job = self._take() if broken_off is None else None
        if broken_off is not None:
            self._close(broken_off, worker)
        elif job is not None:
            self._advance(job, worker)
        return True

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

    def _advance(self, job: Job, worker: Worker) -> None:
        """Do one job, or one item of a stream; an unfinished stream goes back in line."""
        job.alive = time.monotonic()
        job.worker = worker
        worker.inside.append(job)
        try:
            self._work(job)
        finally:
            worker.inside.remove(job)

    def _work(self, job: Job) -> None:
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
        except (Exception, SystemExit) as error:
            # A bug, or a stranger's sys.exit, must reach the person as a sentence.
            log.exception("A job in the channel %s failed", job.channel)
            self._delivered.emit(job, "error", error)
            return
        self._delivered.emit(job, "item", item)
        with self._wake:
            if not job.run.cancelled:
                self._waiting.append(job)
            else:
                self._broken_off.append(job)
                self._wake.notify()

    def _close(self, job: Job, worker: Worker) -> None:
        """End a stream that nobody wants any more of: its own threads and factors go now."""
        assert job.stream is not None
        job.alive = time.monotonic()
        worker.inside.append(job)
        try:
            job.stream.close()
        except Exception:
            log.exception("A job in the channel %s failed when it was broken off", job.channel)
        finally:
            worker.inside.remove(job)
            job.stream = None

    def _ticked(self, job: Job, fraction: float, text: str) -> None:
        """Report progress and let urgent work in; called by the engine, often."""
        now = job.alive = time.monotonic()
        worker = job.worker
        if now - job.last_report >= PROGRESS_INTERVAL:
            job.last_report = now
            self.progressed.emit(job.channel, float(fraction), text)
        if worker is None or worker.left:
            return
        while (other := self._take(urgent_below=job.priority)) is not None:
            self._advance(other, worker)
            job.alive = time.monotonic()

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
