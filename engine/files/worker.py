"""The file worker: reads one job after the other from its standard input until that ends."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from typing import Any, BinaryIO

from engine.errors import EngineError
from engine.files import limits
from engine.files.report import READING
from engine.files.wire import Arrays, receive, send

Tick = Callable[[float, str], None]


def main() -> None:
    """Serve jobs; every answer is a result or one sentence why there is none."""
    incoming, outgoing = _private_pipes()
    limits.cap_own_memory()
    _import_native_code()
    while True:
        try:
            job, arrays = receive(incoming)
        except EOFError:
            return
        send(outgoing, {"begun": True})
        limits.die_after(4 * float(job["seconds"]) + 10.0)
        fit = _serve(job, arrays, outgoing)
        limits.die_after(0.0)
        if not fit:
            os._exit(0)


def _serve(job: dict[str, Any], arrays: Arrays, outgoing: BinaryIO) -> bool:
    """Do a job and answer; return whether the process is fit for another one."""
    from engine.files import native
    from engine.files.exporting import export_mesh
    from engine.files.importing import import_file
    from engine.files.remeshing import remesh_part

    def tick(fraction: float, text: str) -> None:
        if text == READING:
            # A slow network is not the file's fault, as long as something comes.
            limits.die_after(4 * float(job["seconds"]) + 10.0)
        send(outgoing, {"fraction": fraction, "text": text})

    jobs = {"import": import_file, "export": export_mesh, "remesh": remesh_part}
    answer: dict[str, Any]
    found: Arrays = {}
    # What native code had allocated stays taken, and what a damaged file did to its memory would
    # show in the next one.
    fit = True
    try:
        answer, found = jobs[job["job"]](job, arrays, tick)
    except EngineError as error:
        answer = {"error": str(error), "kind": type(error).__name__}
    except MemoryError:
        answer = {"error": _too_large(job["name"]), "kind": "FileError"}
        fit = False
    except Exception as error:  # noqa: BLE001
        # A flaw of our own must cost a sentence too, and not the warm process.
        traceback.print_exc()
        answer = {"error": _unexpected(job, error), "kind": "FileError"}
    fit = fit and not native.has_read
    if not fit:
        answer["ends"] = True
    send(outgoing, answer, found)
    return fit


def _unexpected(job: dict[str, Any], error: Exception) -> str:
    what = "could not be read" if job["job"] == "import" else "was not saved"
    return (
        f"“{job['name']}” {what}: something in it was not foreseen ({type(error).__name__}). "
        "Save it in another format, and please report this."
    )


def _too_large(name: str) -> str:
    return (
        f"“{name}” needs more than {limits.MEMORY / 2**30:.0f} GiB of memory, the most that is "
        "used. Save it with fewer faces, or as binary PLY."
    )


def _private_pipes() -> tuple[BinaryIO, BinaryIO]:
    """Keep the pipes for messages only: native code prints to standard output."""
    incoming = os.fdopen(os.dup(0), "rb", buffering=0)
    outgoing = os.fdopen(os.dup(1), "wb", buffering=1 << 20)
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1):
        os.dup2(nothing, descriptor)
    os.close(nothing)
    sys.stdin = sys.stdout = os.fdopen(os.open(os.devnull, os.O_RDWR), "r+")
    return incoming, outgoing


def _import_native_code() -> None:
    """Import pymeshlab in the main thread before the first job: elsewhere it aborts at exit."""
    import locale

    import pymeshlab  # noqa: F401

    # Where the system has no C.UTF-8 all stays "C"; in no case a comma.
    locale.setlocale(locale.LC_NUMERIC, "C")


if __name__ == "__main__":
    main()
