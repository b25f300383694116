"""Patience with tools: one that keeps the window's thread for too long is interrupted."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

SECONDS = 10.0
LOOK = 0.2


class ToolHungError(Exception):
    """Raised inside a tool that did not come back: it passes through the tool to who called it."""

    def __str__(self) -> str:
        return f"it did not come back within {SECONDS:g} seconds"


class Patience:
    """Watches calls into tools from a thread of its own, which lives as long as a gesture.

    Only Python code can be interrupted. A tool that hangs in native code keeps the window.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._since: float | None = None
        self._fired = False
        self._ended: threading.Event | None = None
        self._caller = 0

    def begin(self) -> None:
        """Watch from now on."""
        self.end()
        self._caller = threading.get_ident()
        self._ended = threading.Event()
        threading.Thread(
            target=self._watch, args=(self._ended,), name="patience", daemon=True
        ).start()

    def end(self) -> None:
        """Watch no longer."""
        if self._ended is not None:
            self._ended.set()
            self._ended = None

    @contextmanager
    def call(self) -> Iterator[None]:
        """A call into a tool; `ToolHungError` is raised inside it when it takes too long."""
        with self._lock:
            self._since = time.monotonic()
        try:
            yield
        finally:
            with self._lock:
                self._since = None
                if self._fired:
                    # The tool came back in the same moment: nothing else must be hit.
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._caller), None)
                    self._fired = False

    def _watch(self, ended: threading.Event) -> None:
        while not ended.wait(LOOK):
            with self._lock:
                late = self._since is not None and time.monotonic() - self._since > SECONDS
                if late and not self._fired:
                    self._fired = True
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(
                        ctypes.c_ulong(self._caller), ctypes.py_object(ToolHungError)
                    )
