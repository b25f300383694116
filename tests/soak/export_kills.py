"""Kill programs that save, at any byte and at any moment: the target is never half a file.

    python -m tests.soak.export_kills --count 1000 --seed 1

Two contents are saved in turns over the same file, as a mesh in every format and as a document.
Every time the process that writes is killed: most by the system, at the very byte that was drawn
(its files may not grow beyond), some at a random moment, which reaches the flushing, the reading
back and the renaming, and some together with the whole program. Afterwards the file must hold one
of the two contents to the last bit, and sweeping must leave nothing else in the folder. It ends
with 1 on any fault.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
import pytest

from engine import Document, FileError, History, HistoryState, Mesh, save
from engine.archive import DOCUMENT_SUFFIX, open_archive, save_archive
from engine.files.process import spawn, worker
from engine.io import sweep_strays
from tests.soak import mortal_worker
from tests.soak.plain_readers import read_plainly

ROOT = Path(__file__).resolve().parents[2]
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".3mf", DOCUMENT_SUFFIX)
MORTAL = "tests.soak.mortal_worker"
PATIENCE = 120.0
"""How long a process is waited for at the most, in seconds."""


def sheet(turn: int, size: int = 40) -> Mesh:
    """Return the mesh that is saved in the given turn (0 or 1): a bent sheet or a taller one."""
    x, y = np.meshgrid(np.arange(size, dtype=float), np.arange(size, dtype=float))
    z = np.sin(x / 3 + turn) * (1 + turn)
    corner = (np.arange(size - 1)[:, None] * size + np.arange(size - 1)).ravel()
    a, b, c, d = corner, corner + 1, corner + size + 1, corner + size
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    # Single precision, so that STL holds it to the last bit too.
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype(np.float32)
    return Mesh(points.astype(np.float64), faces)


def save_for_ever(target: Path) -> None:
    """Save the two contents in turns and say so on standard output, until killed."""
    turn = 0
    while True:
        save_either(turn, target)
        print("saved", worker.pid or 0, flush=True)
        turn = 1 - turn


@dataclass
class Tally:
    """How it went."""

    kills: Counter[str] = field(default_factory=Counter)
    strays: int = 0
    faults: list[str] = field(default_factory=list)


def document(turn: int) -> HistoryState:
    """Return a document of the turn's sheet with a region that was named."""
    history = History(Document.open(sheet(turn), f"sheet {turn}"))
    history.add(history.current.with_region("part", np.arange(90 + turn)), "Region")
    return history.state()


def save_either(turn: int, target: Path) -> None:
    """Save what the turn has, as the target's ending says."""
    if target.suffix == DOCUMENT_SUFFIX:
        save_archive(target, document(turn))
    else:
        save(sheet(turn), target)


def content(path: Path) -> bytes:
    """Return the triangles' corners in the file as bytes, a mesh read by the plain reader."""
    if path.suffix == DOCUMENT_SUFFIX:
        found = open_archive(path, {})
        if found.report:
            return b""
        mesh = found.state.current.mesh
        return (mesh.vertices[mesh.faces].reshape(-1, 3)).tobytes()
    vertices, polygons = read_plainly(path.read_bytes(), path.suffix[1:].upper())
    return np.array([vertices[i] for p in polygons for i in p], dtype=float).tobytes()


def expected() -> set[bytes]:
    """Return what the target may hold."""
    return {(m.vertices[m.faces].reshape(-1, 3)).tobytes() for m in (sheet(0), sheet(1))}


class Forked:
    """A file worker forked from this process, which saves the time that its imports take."""

    def __init__(self) -> None:
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        self.returncode: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            try:
                os.dup2(theirs_in, 0)
                os.dup2(theirs_out, 1)
                for pipe in (ours_in, ours_out, theirs_in, theirs_out):
                    os.close(pipe)
                mortal_worker.main()
            finally:
                os._exit(0)
        os.close(theirs_in)
        os.close(theirs_out)
        self.stdin = os.fdopen(ours_out, "wb", buffering=0)
        self.stdout = os.fdopen(ours_in, "rb")

    def poll(self) -> int | None:
        """Return how it ended, or None while it runs."""
        return self._look(os.WNOHANG)

    def kill(self) -> None:
        """Kill it, if it still runs."""
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int | None:
        """Wait until it has ended, which it is about to; return how."""
        return self._look(0)

    def _look(self, how: int) -> int | None:
        if self.returncode is None:
            ended, status = os.waitpid(self.pid, how)
            if ended:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode


@contextmanager
def mortal(forked: bool) -> Iterator[None]:
    """Have the file worker killed, not refused, where its file may not grow any more."""
    worker.stop()
    if forked:
        # What a worker would import at its first job is then there already.
        import pymeshlab  # noqa: F401

        import engine.files.exporting  # noqa: F401
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "spawn", Forked if forked else lambda: spawn(MORTAL))
        try:
            yield
        finally:
            worker.stop()


def save_with_warm_worker(target: Path) -> int:
    """Save both meshes, the first one last; return the size of the other's file.

    So what is limited next is a save and not the start of the worker.
    """
    size = save(sheet(1), target).size
    save(sheet(0), target)
    return size


def kill_at_byte(target: Path, rng: random.Random) -> str:
    """Save here; the worker is killed at a byte of the file. Return what the person is told."""
    limit = rng.randrange(save_with_warm_worker(target))
    assert worker.pid is not None
    psutil.Process(worker.pid).rlimit(psutil.RLIMIT_FSIZE, (limit, limit))
    return _told(target)


def kill_at_moment(target: Path, rng: random.Random) -> str:
    """Save here and kill the file worker at some moment; return what the person is told, or ""."""
    save_with_warm_worker(target)
    start = time.monotonic()
    save(sheet(0), target)
    moment = rng.random() * (time.monotonic() - start)
    timer = threading.Timer(moment, os.kill, (worker.pid, signal.SIGKILL))
    timer.start()
    try:
        return _told(target)
    finally:
        timer.join()


def _told(target: Path) -> str:
    try:
        save(sheet(1), target)
    except FileError as error:
        return str(error)
    return ""


def kill_document(target: Path, rng: random.Random, at_byte: bool) -> bool:
    """Save a document in a process of its own that is killed; return whether it was in time."""
    import resource

    limit = rng.randrange(target.stat().st_size)
    start = time.monotonic()
    save_archive(target, document(0))
    moment = rng.random() * (time.monotonic() - start)
    state = document(1)
    with warnings.catch_warnings():
        # The child only writes a file; it takes no lock that another thread may hold.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        try:
            if at_byte:
                signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
                resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            else:
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_REAL, max(moment, 1e-6))
            save_archive(target, state)
        finally:
            os._exit(0)
    with killed_after(PATIENCE, child) as late:
        _, status = os.waitpid(child, 0)
    assert not late, f"a document was still being saved after {PATIENCE:.0f} s"
    return os.WIFSIGNALED(status)


@contextmanager
def killed_after(seconds: float, pid: int) -> Iterator[list[float]]:
    """Kill a process that is waited for too long, and note so in the list that is given."""
    late: list[float] = []

    def kill() -> None:
        late.append(seconds)
        os.kill(pid, signal.SIGKILL)

    timer = threading.Timer(seconds, kill)
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()
        timer.join()


def kill_program(target: Path, rng: random.Random) -> int:
    """Start the saving program, kill it somewhere in a save, and return how many strays it left."""
    command = [sys.executable, "-m", "tests.soak.export_kills", "--save", str(target)]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT)
    assert program.stdout is not None
    with killed_after(PATIENCE, program.pid) as late:
        words = program.stdout.readline().split()
        start = time.monotonic()
        program.stdout.readline()
    assert not late, f"the saving program said nothing for {PATIENCE:.0f} s"
    time.sleep(rng.random() * (time.monotonic() - start))
    program.kill()
    program.wait(PATIENCE)
    program.stdout.close()
    # Its worker ends by itself, once its job is done and nobody asks for another.
    if int(words[1]):
        _wait_for_end(int(words[1]))
    return len(sweep_strays(target.parent))


def _wait_for_end(pid: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.005)
    raise AssertionError(f"the file worker {pid} outlives its program")


def kill_one(target: Path, rng: random.Random, programs: float, tally: Tally) -> None:
    """Kill one save over `target`, and note which way and what was wrong with it."""
    dice = rng.random()
    if dice < programs:
        tally.strays += kill_program(target, rng)
        tally.kills["program, at a moment"] += 1
        return
    at_byte = dice < programs + 0.8 * (1 - programs)
    when = "at a byte" if at_byte else "at a moment"
    if target.suffix == DOCUMENT_SUFFIX:
        if not kill_document(target, rng, at_byte):
            when = "saved before"
        tally.kills[f"document, {when}"] += 1
        tally.strays += len(sweep_strays(target.parent))
    else:
        told = (kill_at_byte if at_byte else kill_at_moment)(target, rng)
        tally.kills[f"worker, {when if told else 'saved before'}"] += 1
        if (told or at_byte) and (target.name not in told or "unchanged" not in told):
            tally.faults.append(f"{target.name} {when}: {told or 'nothing was said'}")


def run(count: int, seed: int, folder: Path, programs: float = 0.05, forked: bool = False) -> Tally:
    """Kill `count` times: the share `programs` of them the whole program, by time."""
    rng = random.Random(seed)
    tally = Tally()
    right = expected()
    with mortal(forked):
        for i in range(count):
            target = folder / f"model{SUFFIXES[i % len(SUFFIXES)]}"
            if not target.exists():
                save_either(0, target)
            kill_one(target, rng, programs, tally)
            if content(target) not in right:
                tally.faults.append(f"{i}: {target.name} is neither the old file nor the new one")
            others = [p.name for p in folder.iterdir() if p.stem != "model"]
            if others:
                tally.faults.append(f"kill {i}: left behind {others}")
            if i % 50 == 49:
                print(f"{i + 1} kills, {len(tally.faults)} faults", flush=True)
    return tally


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--save", type=Path, help="save there for ever (used by the test itself)")
    options = parser.parse_args()
    if options.save:
        save_for_ever(options.save)
    with tempfile.TemporaryDirectory() as folder:
        tally = run(options.count, options.seed, Path(folder), forked=True)
    print(f"kills: {dict(tally.kills)}; strays swept: {tally.strays}; faults: {len(tally.faults)}")
    for fault in tally.faults[:50]:
        print(fault)
    return int(bool(tally.faults))


if __name__ == "__main__":
    sys.exit(main())
