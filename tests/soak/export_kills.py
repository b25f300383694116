"""Kill a program that saves, at random moments, and see that the target is never half a file.

    python -m tests.soak.export_kills --count 1000 --seed 1

One process saves two meshes in turns over the same file. Every time it, or its file worker, is
killed somewhere inside a save; afterwards the file must hold one of the two meshes to the last bit,
and sweeping must leave nothing else in the folder. It ends with 1 on any fault.
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
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from engine import FileError, Mesh, save
from engine.files.process import worker
from engine.io import sweep_strays
from tests.soak.plain_readers import read_plainly

ROOT = Path(__file__).resolve().parents[2]
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".3mf")


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
    """Save the two meshes in turns and say so on standard output, until killed."""
    meshes = [sheet(0), sheet(1)]
    turn = 0
    while True:
        save(meshes[turn], target)
        print("saved", worker.pid, flush=True)
        turn = 1 - turn


@dataclass
class Tally:
    """How it went."""

    kills: Counter[str] = field(default_factory=Counter)
    strays: int = 0
    faults: list[str] = field(default_factory=list)


def content(path: Path) -> bytes:
    """Return the triangles' corners in the file, read by the plain reader, as bytes."""
    vertices, polygons = read_plainly(path.read_bytes(), path.suffix[1:].upper())
    return np.array([vertices[i] for p in polygons for i in p], dtype=float).tobytes()


def expected() -> set[bytes]:
    """Return what the target may hold."""
    return {(m.vertices[m.faces].reshape(-1, 3)).tobytes() for m in (sheet(0), sheet(1))}


def kill_program(target: Path, rng: random.Random) -> int:
    """Start the saving program, kill it somewhere in a save, and return how many strays it left."""
    command = [sys.executable, "-m", "tests.soak.export_kills", "--save", str(target)]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT)
    assert program.stdout is not None
    words = program.stdout.readline().split()
    start = time.monotonic()
    program.stdout.readline()
    time.sleep(rng.random() * (time.monotonic() - start))
    program.kill()
    program.wait()
    program.stdout.close()
    # Its worker ends by itself, once its job is done and nobody asks for another.
    _wait_for_end(int(words[1]))
    return len(sweep_strays(target.parent))


def _wait_for_end(pid: int) -> None:
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.005)
    raise AssertionError(f"the file worker {pid} outlives its program")


def kill_worker(target: Path, rng: random.Random) -> str:
    """Save here and kill the file worker meanwhile; return what the person is told, "" if saved."""
    if worker.pid is None:
        save(sheet(0), target)
    start = time.monotonic()
    save(sheet(0), target)
    moment = rng.random() * (time.monotonic() - start)
    timer = threading.Timer(moment, os.kill, (worker.pid, signal.SIGKILL))
    timer.start()
    try:
        save(sheet(1), target)
    except FileError as error:
        return str(error)
    finally:
        timer.join()
    return ""


def run(count: int, seed: int, folder: Path, programs: float = 0.1) -> Tally:
    """Kill `count` times: the share `programs` of them the whole program, the others the worker."""
    rng = random.Random(seed)
    tally = Tally()
    right = expected()
    for i in range(count):
        target = folder / f"model{SUFFIXES[i % len(SUFFIXES)]}"
        if not target.exists():
            save(sheet(0), target)
        if rng.random() < programs:
            tally.strays += kill_program(target, rng)
            tally.kills["program"] += 1
        else:
            told = kill_worker(target, rng)
            tally.kills["worker, refused" if told else "worker, saved before"] += 1
            if told and (target.name not in told or "unchanged" not in told):
                tally.faults.append(f"kill {i}: {told}")
        if content(target) not in right:
            tally.faults.append(f"kill {i}: {target.name} is neither the old file nor the new one")
        others = [p.name for p in folder.iterdir() if p.suffix not in SUFFIXES or p.name[0] == "."]
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
        tally = run(options.count, options.seed, Path(folder))
    print(f"kills: {dict(tally.kills)}; strays swept: {tally.strays}; faults: {len(tally.faults)}")
    for fault in tally.faults[:50]:
        print(fault)
    return int(bool(tally.faults))


if __name__ == "__main__":
    sys.exit(main())
