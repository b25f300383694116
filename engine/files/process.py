"""The program's side of the file worker: one process, one job at a time, killed when it must be."""

from __future__ import annotations

import atexit
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from engine.errors import Cancelled, EngineError, FileError, MeshError
from engine.files import limits
from engine.files.report import READING
from engine.files.scratch import sweep_scratch
from engine.files.wire import Arrays, receive, send
from engine.run import Run

_ERRORS: dict[str, type[EngineError]] = {"FileError": FileError, "MeshError": MeshError}
_POLL = 0.05
_LAST_BREATH = 5.0
_UNBEGUN = "Starting"

_Answers = queue.Queue[tuple[dict[str, Any], Arrays] | None]


class WorkerLostError(Exception):
    """The worker gave no answer.

    Parameters
    ----------
    stage : the words of the last progress that it reported.
    """

    def __init__(self, stage: str) -> None:
        super().__init__(stage)
        self.stage = stage


class WorkerDiedError(WorkerLostError):
    """The worker ended before it answered.

    Parameters
    ----------
    stage : the words of the last progress that it reported.
    killed : somebody ended it from outside, as a system does that runs out of memory.
    """

    def __init__(self, stage: str, killed: bool = False) -> None:
        super().__init__(stage)
        self.killed = killed


class WorkerSlowError(WorkerLostError):
    """The worker did not answer within its time."""


def spawn(module: str = "engine.files.worker", *arguments: str) -> subprocess.Popen[bytes]:
    """Start a process that serves jobs, with pipes for jobs and answers."""
    interpreter, environment = _interpreter()
    return subprocess.Popen(
        [interpreter, "-m", module, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=_environment() | environment,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )


class FileWorker:
    """A process that parses, cleans and writes files, so that a crash there costs one sentence.

    It is started when first needed (or by `start`), kept warm, and replaced after it was killed.
    `spawn` starts it.
    """

    def __init__(self) -> None:
        self.spawn: Callable[[], subprocess.Popen[bytes]] = spawn
        self._one_job = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._job_object: int | None = None

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
        WorkerDiedError, WorkerSlowError
            It crashed, ran out of memory, or took longer than `seconds`.
        """
        while not self._one_job.acquire(timeout=_POLL):
            _tick(run, 0.0, "Waiting for another file")
        try:
            return self._answer(job, arrays, seconds, run)
        finally:
            self._one_job.release()

    def _answer(
        self, job: dict[str, Any], arrays: Arrays | None, seconds: float, run: Run | None
    ) -> tuple[dict[str, Any], Arrays]:
        """Do the job; once more on a fresh process where the end of the first was not its fault.

        That is when the warm one ended before it began, or was killed from outside while it read.
        """
        try:
            return self._ask(job, arrays, seconds, run)
        except (FileError, MeshError):
            # A refusal leaves the process ready for the next job.
            raise
        except WorkerDiedError as lost:
            self._replace()
            if lost.stage != _UNBEGUN and not (lost.killed and job["job"] == "import"):
                raise
        except BaseException:
            # Whatever it was doing is not wanted any more.
            self._replace()
            raise
        return self._ask(job, arrays, seconds, run)

    def _replace(self) -> None:
        self.stop()
        self._ensure()

    def _ask(
        self, job: dict[str, Any], arrays: Arrays | None, seconds: float, run: Run | None
    ) -> tuple[dict[str, Any], Arrays]:
        _tick(run, 0.0, _UNBEGUN)
        process = self._ensure()
        assert process.stdin is not None
        answers: _Answers = queue.Queue()
        listener = threading.Thread(
            target=_listen, args=(process.stdout, answers), name="file-worker", daemon=True
        )
        listener.start()
        fraction, text = 0.0, _UNBEGUN
        try:
            send(process.stdin, {**job, "seconds": seconds}, arrays)  # type: ignore[arg-type]
        except OSError as error:
            raise WorkerDiedError(text, self._was_killed(process)) from error
        clock = _Clock(process.pid, seconds)
        while True:
            try:
                answer = answers.get(timeout=_POLL)
            except queue.Empty:
                _tick(run, fraction, text)
                if clock.is_up():
                    raise WorkerSlowError(text) from None
                continue
            if answer is None:
                raise WorkerDiedError(text, self._was_killed(process))
            message, found = answer
            if "ends" in message:
                self._replace()
            if "error" in message:
                raise _ERRORS.get(message["kind"], FileError)(message["error"])
            if "begun" in message:
                clock = _Clock(process.pid, seconds)
                text = "Begun"
            elif "fraction" in message:
                fraction, text = message["fraction"], message["text"]
                if text == READING:
                    clock.begin_again()
                _tick(run, fraction, text)
            else:
                return message, found

    def _was_killed(self, process: subprocess.Popen[bytes]) -> bool:
        """Whether a process whose pipe is closed was ended by somebody else than this program.

        Native code that goes astray ends by SIGSEGV or SIGABRT; Windows does not tell.
        """
        kill = getattr(signal, "SIGKILL", None)
        if kill is None or self._process is not process:
            return False
        try:
            return bool(process.wait(timeout=_LAST_BREATH) == -kill)
        except subprocess.TimeoutExpired:
            return False

    def _ensure(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.stop()
        self._process = self.spawn()
        self._job_object = limits.cap_from_outside(self._process)
        return self._process

    def stop(self) -> None:
        """Kill the process; the next job starts another."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        sweep_scratch(process.pid)
        job, self._job_object = self._job_object, None
        limits.close_job(job)
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except OSError:
                    continue


class _Clock:
    """How long a job may take: `seconds` of work, and four times that in all since the file came.

    A slow drive or a busy machine is not the file's fault; native code that hangs works hard.
    """

    def __init__(self, pid: int, seconds: float) -> None:
        self._pid = pid
        self._work_end = self._work() + seconds
        self._seconds = seconds
        self.begin_again()

    def begin_again(self) -> None:
        """Note that something came from the disk or network just now."""
        self._end = time.monotonic() + 4 * self._seconds

    def _work(self) -> float:
        try:
            times = psutil.Process(self._pid).cpu_times()
        except psutil.Error:
            return 0.0
        return float(times.user + times.system)

    def is_up(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self._end or self._work() > self._work_end


def _tick(run: Run | None, fraction: float, text: str) -> None:
    if run is not None:
        run.tick(fraction, text)


def _listen(stream: Any, answers: _Answers) -> None:
    """Pass on the messages of one job, up to its answer or the end of the process."""
    try:
        while True:
            message, arrays = receive(stream)
            answers.put((message, arrays))
            if "begun" not in message and "fraction" not in message:
                return
    except (EOFError, OSError, ValueError):
        answers.put(None)


def _interpreter() -> tuple[str, dict[str, str]]:
    """Return the Python to start, and what it needs to know.

    In a virtual environment on Windows, python.exe only starts the real one: limits and kills would
    reach the wrong process. The real one is told where it belongs, as multiprocessing does it.
    """
    real = getattr(sys, "_base_executable", sys.executable)
    if os.name != "nt" or real == sys.executable:
        return sys.executable, {}
    return real, {"__PYVENV_LAUNCHER__": sys.executable}


def _environment() -> dict[str, str]:
    """Return the worker's environment: numbers in the C locale, one thread, this very engine."""
    home = str(Path(__file__).resolve().parents[2])
    rest = os.environ.get("PYTHONPATH", "")
    return {
        **os.environ,
        # Under a comma locale the native readers cut 0.348 to 0 without a word. Not plain "C": in
        # that they could not write into a folder whose name is not ASCII.
        "LC_ALL": "C.UTF-8",
        "PYTHONUTF8": "1",
        "PYTHONPATH": os.pathsep.join([home, rest] if rest else [home]),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        # Some format plugins are Qt code; they must not look for a display.
        "QT_QPA_PLATFORM": "offscreen",
    }


worker = FileWorker()
atexit.register(worker.stop)

__all__ = ["Cancelled", "FileWorker", "WorkerDiedError", "WorkerSlowError", "worker"]
