"""What a file worker may use: memory by the operating system, time by the clock."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

MEMORY = 6 << 30
SECONDS_LEAST = 20.0
SECONDS_PER_BYTE = 10.0 / 100e6


def seconds_for(size: int) -> float:
    """Return how long a file of `size` bytes may take: 10 s per 100 MB, at least 20 s."""
    return max(SECONDS_LEAST, size * SECONDS_PER_BYTE)


# Bytes at the peak for each byte of the file, as measured at half a million faces, rounded up.
_FACTOR = {".obj": 12.0, ".off": 12.0, ".stl": 12.0, ".ply": 20.0, ".3mf": 45.0}
_FACTOR_ELSE = 30.0
_WORKER = 200 << 20


def memory_needed(path: Path, size: int) -> int:
    """Return about how many bytes of memory opening a file of `size` bytes takes."""
    return int(_WORKER + size * _FACTOR.get(path.suffix.lower(), _FACTOR_ELSE))


def cap_own_memory() -> None:
    """Cap the address space of this process; on Windows `cap_from_outside` does it."""
    if sys.platform == "win32":
        return
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_AS)
    cap = MEMORY if most == resource.RLIM_INFINITY else min(MEMORY, most)
    # macOS knows the limit but does not let every process set it: the time limit still holds.
    try:
        resource.setrlimit(resource.RLIMIT_AS, (cap, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (OSError, ValueError):
        return


def die_after(seconds: float) -> None:
    """Let the operating system end this process then, should nobody be left to do it.

    The program that started the worker normally does; this is for when it was killed itself, while
    native code here holds the interpreter.
    """
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def cap_from_outside(process: subprocess.Popen[bytes]) -> Any:
    """Put `process` into a Windows job with the memory cap; it ends when the program ends.

    Returns the job's handle, which must be kept as long as the process; None elsewhere.
    """
    return _windows_job(process) if os.name == "nt" else None


class _BasicLimits(ctypes.Structure):
    _fields_ = [
        ("PerProcessUserTimeLimit", ctypes.c_int64),
        ("PerJobUserTimeLimit", ctypes.c_int64),
        ("LimitFlags", ctypes.c_uint32),
        ("MinimumWorkingSetSize", ctypes.c_size_t),
        ("MaximumWorkingSetSize", ctypes.c_size_t),
        ("ActiveProcessLimit", ctypes.c_uint32),
        ("Affinity", ctypes.c_size_t),
        ("PriorityClass", ctypes.c_uint32),
        ("SchedulingClass", ctypes.c_uint32),
    ]


class _ExtendedLimits(ctypes.Structure):
    _fields_ = [
        ("BasicLimitInformation", _BasicLimits),
        ("IoInfo", ctypes.c_uint64 * 6),
        ("ProcessMemoryLimit", ctypes.c_size_t),
        ("JobMemoryLimit", ctypes.c_size_t),
        ("PeakProcessMemoryUsed", ctypes.c_size_t),
        ("PeakJobMemoryUsed", ctypes.c_size_t),
    ]


_PROCESS_MEMORY = 0x100
_KILL_ON_JOB_CLOSE = 0x2000
_EXTENDED_LIMIT_INFORMATION = 9


def _windows_job(process: Any) -> Any:
    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined,unused-ignore]
    kernel.CreateJobObjectW.restype = ctypes.c_void_p
    job = ctypes.c_void_p(kernel.CreateJobObjectW(None, None))
    limits = _ExtendedLimits()
    limits.BasicLimitInformation.LimitFlags = _PROCESS_MEMORY | _KILL_ON_JOB_CLOSE
    limits.ProcessMemoryLimit = MEMORY
    kernel.SetInformationJobObject(
        job, _EXTENDED_LIMIT_INFORMATION, ctypes.byref(limits), ctypes.sizeof(limits)
    )
    kernel.AssignProcessToJobObject(job, ctypes.c_void_p(int(process._handle)))
    return job
