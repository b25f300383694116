"""What is measured; each function returns plain numbers and runs in a process of its own."""

from __future__ import annotations

import resource
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from bench.surfaces import sheet
from engine import Cancelled, Run, decompose, decompose_stream

Figures = dict[str, float]


def modes(m: int, k: int) -> Figures:
    """Time to base, to the first 50 modes and to k modes of a region of m vertices."""
    mesh, roi = sheet(m)
    decompose(*sheet(400), modes=50)
    begun, begun_cpu = time.perf_counter(), time.process_time()
    at: Figures = {}
    for parts in decompose_stream(mesh, roi, modes=k):
        now = time.perf_counter() - begun
        if parts.k == 0:
            at["base"] = now
        if parts.k >= 50:
            at.setdefault("first 50", now)
    at["all"] = time.perf_counter() - begun
    at["cpu"] = time.process_time() - begun_cpu
    gram = parts.modes.T @ (parts.areas[:, None] * parts.modes)
    at["orthonormality"] = float(np.abs(gram - np.eye(parts.k)).max())
    at["modes"] = parts.k
    at["memory GiB"] = peak_memory()
    return at


def base(m: int) -> Figures:
    """Time from a chosen region to its base shape."""
    mesh, roi = sheet(m)
    decompose(*sheet(400), modes=0)
    mesh.topology.adjacency, mesh.topology.border_vertices, mesh.topology.nonmanifold_vertices  # noqa: B018
    begun, begun_cpu = time.perf_counter(), time.process_time()
    decompose(mesh, roi, modes=0)
    return {
        "base": time.perf_counter() - begun,
        "cpu": time.process_time() - begun_cpu,
        "memory GiB": peak_memory(),
    }


def whole_slider(m: int) -> Figures:
    """Time until the slider is exact from 0 to 1, and of a step of it."""
    mesh, roi = sheet(m)
    begun = time.perf_counter()
    for parts in decompose_stream(mesh, roi):
        if parts.k:
            at = time.perf_counter() - begun
    rest = time.perf_counter() - begun
    steps = []
    for level in np.random.default_rng(0).uniform(0, 1, 300):
        begun = time.perf_counter()
        parts.surface(parts.mode_count(float(level)))
        steps.append(time.perf_counter() - begun)
    return {
        "complete": rest,
        "last": at,
        "step median": float(np.median(steps)),
        "step worst": max(steps),
        "memory GiB": peak_memory(),
    }


def cancel(m: int) -> Figures:
    """Longest time from asking to the answer, asked at several moments."""
    mesh, roi = sheet(m)
    longest = 0.0
    for after in (0.02, 0.1, 0.3, 0.6, 1.0, 1.5):
        run = Run()
        timer = _CancelAfter(run, after)
        try:
            decompose(mesh, roi, run=run)
        except Cancelled:
            longest = max(longest, time.perf_counter() - timer.asked)
    return {"cancel": longest}


class _CancelAfter(threading.Timer):
    def __init__(self, run: Run, after: float) -> None:
        super().__init__(after, self._ask)
        self._run = run
        self.asked = np.inf
        self.start()

    def _ask(self) -> None:
        self.asked = time.perf_counter()
        self._run.cancel()


def stall(m: int) -> Figures:
    """Longest time beyond 16 ms that a ticking thread waits while a region is decomposed."""
    mesh, roi = sheet(m)
    idle = _longest_tick(lambda: time.sleep(3.0))
    work = _longest_tick(lambda: decompose(mesh, roi))
    return {"stall": work, "stall idle": idle}


def _longest_tick(work: Callable[[], object]) -> float:
    thread = threading.Thread(target=work)
    thread.start()
    longest, last = 0.0, time.perf_counter()
    while thread.is_alive():
        time.sleep(0.016)
        now = time.perf_counter()
        longest = max(longest, now - last - 0.016)
        last = now
    return longest


def peak_memory() -> float:
    """Peak resident memory of this process in GiB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**30 if sys.platform == "darwin" else 2**20)
