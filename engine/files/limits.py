"""What a file worker may use: memory by the operating system, time by the clock."""

from __future__ import annotations

import ctypes
import logging
import os
import signal
import subprocess
import sys
from ctypes import wintypes
from pathlib import Path
from typing import Any

log = logging.getLogger(__name__)

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


def cap_from_outside(process: subprocess.Popen[bytes]) -> int | None:
    """Put `process` into a Windows job with the memory cap; it ends when the program ends.

    Returns the job's handle, to be kept as long as the process and then given to `close_job`; None
    elsewhere, and where Windows refuses it: the limits of time still hold then.
    """
    if os.name != "nt":
        return None
    started: Any = process
    return windows_job(_kernel(), int(started._handle))


def close_job(job: int | None) -> None:
    """Let go of a job; what still runs in it ends."""
    if job is not None:
        _kernel().CloseHandle(job)


class BasicLimits(ctypes.Structure):
    """JOBOBJECT_BASIC_LIMIT_INFORMATION of Windows."""

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


class ExtendedLimits(ctypes.Structure):
    """JOBOBJECT_EXTENDED_LIMIT_INFORMATION of Windows."""

    _fields_ = [
        ("BasicLimitInformation", BasicLimits),
        ("IoInfo", ctypes.c_uint64 * 6),
        ("ProcessMemoryLimit", ctypes.c_size_t),
        ("JobMemoryLimit", ctypes.c_size_t),
        ("PeakProcessMemoryUsed", ctypes.c_size_t),
        ("PeakJobMemoryUsed", ctypes.c_size_t),
    ]


_PROCESS_MEMORY = 0x100
_KILL_ON_JOB_CLOSE = 0x2000
_EXTENDED_LIMIT_INFORMATION = 9

# Handles are as wide as pointers; without these ctypes would cut them to 32 bits.
SIGNATURES: dict[str, tuple[Any, list[Any]]] = {
    "CreateJobObjectW": (wintypes.HANDLE, [wintypes.LPVOID, wintypes.LPCWSTR]),
    "SetInformationJobObject": (
        wintypes.BOOL,
        [wintypes.HANDLE, ctypes.c_int, wintypes.LPVOID, wintypes.DWORD],
    ),
    "AssignProcessToJobObject": (wintypes.BOOL, [wintypes.HANDLE, wintypes.HANDLE]),
    "CloseHandle": (wintypes.BOOL, [wintypes.HANDLE]),
}


def _kernel() -> Any:
    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined,unused-ignore]
    for name, (result, arguments) in SIGNATURES.items():
        function = getattr(kernel, name)
        function.restype, function.argtypes = result, arguments
    return kernel


def windows_job(kernel: Any, process: int) -> int | None:
    """Return a new job, by its handle, that holds a process to `MEMORY`; None if it is refused.

    Parameters
    ----------
    kernel : kernel32, its functions declared by `SIGNATURES`.
    process : the process's handle.
    """
    job: int | None = kernel.CreateJobObjectW(None, None)
    if job is None:
        return None
    held = ExtendedLimits()
    held.BasicLimitInformation.LimitFlags = _PROCESS_MEMORY | _KILL_ON_JOB_CLOSE
    held.ProcessMemoryLimit = MEMORY
    size = ctypes.sizeof(held)
    if kernel.SetInformationJobObject(
        job, _EXTENDED_LIMIT_INFORMATION, ctypes.byref(held), size
    ) and kernel.AssignProcessToJobObject(job, process):
        return job
    log.warning("Windows refused the file worker's limit of memory")
    kernel.CloseHandle(job)
    return None
