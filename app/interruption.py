"""Interruption: an exception sent into another thread, and what must be done about one too late.

Python raises it at that thread's next line. One that is never received (its thread ended, or it was
taken back) leaves the interpreter asking for it before every call from then on: all is slower, and
under a profiler or debugger nothing goes on at all.
"""

from __future__ import annotations

import ctypes
import threading

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
