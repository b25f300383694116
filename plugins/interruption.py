"""Interruption: an exception sent into another thread, and what must be done about one too late.

Python raises it at that thread's next line. One that is never received (its thread ended, or it was
taken back) leaves the interpreter asking for it before every call from then on: all is slower, and
under a profiler or debugger nothing goes on at all.
"""

from __future__ import annotations

import contextlib
import ctypes
import threading
from collections.abc import Callable

_send = ctypes.pythonapi.PyThreadState_SetAsyncExc


def interrupt(thread: int, error: type[BaseException]) -> None:
    """Raise `error` in a thread at its next line of Python; native code it may be in goes on.

    Parameters
    ----------
    thread : the thread's identifier.
    error : what is raised; it takes the place of one that is still under way.
    """
    _send(ctypes.c_ulong(thread), ctypes.py_object(error))


def receive(error: type[BaseException]) -> None:
    """Receive an `error` that may be under way to this thread; afterwards none is."""
    try:
        interrupt(threading.get_ident(), error)
        while True:  # it comes at the end of the first round
            pass
    except error:
        pass


class LeftBehindError(BaseException):
    """Ends a thread whose work is wanted no more; it passes through `except Exception`."""


class InterruptibleThread(threading.Thread):
    """A thread that can be left behind: it ends at its next line of Python.

    Parameters
    ----------
    name : its name.
    work : what is done in it.
    """

    def __init__(self, name: str, work: Callable[[], object]) -> None:
        super().__init__(name=name, daemon=True)
        self._work: Callable[[], object] | None = work
        self._ending = threading.Lock()
        self._ended = False

    def run(self) -> None:
        """Do the work; called in the thread."""
        work, self._work = self._work, None  # what the work holds is let go with it
        assert work is not None
        with contextlib.suppress(LeftBehindError):
            work()
        while not self._ended:
            with contextlib.suppress(LeftBehindError), self._ending:
                self._ended = True
        receive(LeftBehindError)

    def interrupt(self) -> None:
        """End the thread at its next line of Python."""
        with self._ending:
            if self.ident is not None and not self._ended:
                interrupt(self.ident, LeftBehindError)
