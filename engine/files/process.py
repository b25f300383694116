"""The program's side of the file worker: one process, one job at a time, killed when it must be."""

from __future__ import annotations

import atexit
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from engine.errors import Cancelled, EngineError, FileError, MeshError
from engine.files import limits
from engine.files.wire import Arrays, receive, send
from engine.run import Run

_ERRORS: dict[str, type[EngineError]] = {"FileError": FileError, "MeshError": MeshError}
_POLL = 0.05
_START_SECONDS = 60.0


class WorkerDied(Exception):
    """The worker ended before it answered."""


class WorkerSlow(Exception):
    """The worker did not answer within its time."""


class FileWorker:
    """A process that parses, cleans and writes files, so that a crash there costs one sentence.

    It is started when first needed (or by `start`), kept warm, and replaced after it was killed.
    """

    def __init__(self) -> None:
        self._one_job = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._job_object: Any = None
        self._answers: queue.Queue[tuple[dict[str, Any], Arrays] | None] = queue.Queue()

    @property
    def pid(self) -> int | None:
        """The process's id while it runs."""
        return self._process.pid if self._process and self._process.poll() is None else None

    def start(self) -> None:
        """Start the process without waiting for it, unless it runs or somebody uses it."""
        if self._one_job.acquire(blocking=False):
            try:
                self._ensure()
            finally:
                self._one_job.release()

    def ask(
        self, job: dict[str, Any], arrays: Arrays | None, seconds: float, run: Run | None
    ) -> tuple[dict[str, Any], Arrays]:
        """Let the worker do one job and return its answer.

        Raises
        ------
        EngineError
            What the worker refused, or `Cancelled`.
        WorkerDied, WorkerSlow
            It crashed, ran out of memory, or took longer than `seconds`.
        """
        while not self._one_job.acquire(timeout=_POLL):
            _tick(run, 0.0, "Waiting for another file")
        try:
            return self._ask(job, arrays, seconds, run)
        except BaseException as error:
            # Whatever it was doing is not wanted any more; a refusal leaves it ready.
            if not isinstance(error, FileError | MeshError):
                self.stop()
            raise
        finally:
            self._one_job.release()

    def _ask(
        self, job: dict[str, Any], arrays: Arrays | None, seconds: float, run: Run | None
    ) -> tuple[dict[str, Any], Arrays]:
        _tick(run, 0.0, "Starting")
        process = self._ensure()
        assert process.stdin is not None
        try:
            send(process.stdin, {**job, "seconds": seconds}, arrays)  # type: ignore[arg-type]
        except OSError as error:
            raise WorkerDied from error
        deadline = time.monotonic() + seconds + _START_SECONDS
        fraction, text = 0.0, "Starting"
        while True:
            try:
                answer = self._answers.get(timeout=_POLL)
            except queue.Empty:
                _tick(run, fraction, text)
                if time.monotonic() > deadline:
                    raise WorkerSlow from None
                continue
            if answer is None:
                raise WorkerDied
            message, found = answer
            if "error" in message:
                raise _ERRORS.get(message["kind"], FileError)(message["error"])
            if "begun" in message:
                deadline = time.monotonic() + seconds
            elif "fraction" in message:
                fraction, text = message["fraction"], message["text"]
                _tick(run, fraction, text)
            else:
                return message, found

    def _ensure(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is None:
            return self._process
        self._answers = queue.Queue()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "engine.files.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_environment(),
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._job_object = limits.cap_from_outside(self._process)
        threading.Thread(
            target=_listen,
            args=(self._process.stdout, self._answers),
            name="file-worker-answers",
            daemon=True,
        ).start()
        return self._process

    def stop(self) -> None:
        """Kill the process; the next job starts another."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except OSError:
                    continue


def _tick(run: Run | None, fraction: float, text: str) -> None:
    if run is not None:
        run.tick(fraction, text)


def _listen(stream: Any, answers: queue.Queue[tuple[dict[str, Any], Arrays] | None]) -> None:
    try:
        while True:
            answers.put(receive(stream))
    except (EOFError, OSError, ValueError):
        answers.put(None)


def _environment() -> dict[str, str]:
    """Return the worker's environment: numbers in the C locale, one thread, this very engine."""
    home = str(Path(__file__).resolve().parents[2])
    rest = os.environ.get("PYTHONPATH", "")
    return {
        **os.environ,
        # Under a comma locale the native readers cut 0.348 to 0 without a word.
        "LC_ALL": "C",
        "LC_NUMERIC": "C",
        "PYTHONUTF8": "1",
        "PYTHONPATH": os.pathsep.join([home, rest] if rest else [home]),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        # Some format plugins are Qt code; they must not look for a display.
        "QT_QPA_PLATFORM": "offscreen",
    }


worker = FileWorker()
atexit.register(worker.stop)

__all__ = ["Cancelled", "FileWorker", "WorkerDied", "WorkerSlow", "worker"]
