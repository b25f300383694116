"""Patience with tools: one that keeps the window's thread for too long is interrupted."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from plugins.interruption import interrupt, receive

SECONDS = 10.0
LOOK = 0.2
IDLE = 1.0  # seconds without a call after which nobody needs to watch


class ToolHungError(Exception):
    """Raised inside a tool that did not come back: it passes through the tool to who called it."""

    def __str__(self) -> str:
        return f"it did not come back within {SECONDS:g} seconds"


class Patience:
    """Watches calls into tools from a thread of its own, which ends when no more calls come.

    Calls may lie inside each other: a tool previews something, and the window asks for its hint.
    Only Python code can be interrupted. A tool that hangs in native code keeps the window.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._began: list[float] = []  # of the calls under way, the innermost last
        self._last = 0.0
        self._fired = False
        self._caller = 0
        self._watcher: threading.Thread | None = None
        self._stopped = threading.Event()

    @contextmanager
    def call(self) -> Iterator[None]:
        """A call into a tool; `ToolHungError` is raised inside it when it takes too long."""
        with self._lock:
            depth = len(self._began)
            self._began.append(time.monotonic())
            self._caller = threading.get_ident()
            if self._watcher is None:
                self._stopped.clear()
                self._watcher = threading.Thread(target=self._watch, name="patience", daemon=True)
                self._watcher.start()
        try:
            yield
        finally:
            try:
                self._leave(depth)
            except ToolHungError:  # it was on its way while the tool came back
                self._leave(depth)

    def stop(self) -> None:
        """Watch no longer; the next call begins anew."""
        self._stopped.set()

    def _leave(self, depth: int) -> None:
        with self._lock:
            del self._began[depth:]
            self._last = time.monotonic()
            if self._fired:
                # The tool may have come back in the same moment: nothing else must be hit.
                receive(ToolHungError)
                self._fired = False

    def _watch(self) -> None:
        while True:
            stopped = self._stopped.wait(LOOK)
            with self._lock:
                now = time.monotonic()
                if not self._began and (stopped or now - self._last > IDLE):
                    self._watcher = None
                    return
                if self._began and now - self._began[-1] > SECONDS:
                    # Whoever swallows it gets it again.
                    self._began[-1] = now
                    self._fired = True
                    interrupt(self._caller, ToolHungError)
            if stopped:
                time.sleep(LOOK)
