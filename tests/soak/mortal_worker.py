"""The file worker, but for how it dies: really, and where a test wants it to.

Where its file may not grow beyond a limit, the system ends it at that very byte, as a kill would.
Called with `filter`, the system ends it while a native filter runs. Called with `reader`, native
code reaches where there is no memory as soon as it reads a file. Called with `killed`, it is killed
while it reads a file, as by a system that runs out of memory. Called with `slow`, a file comes
to it as from a slow network, in ten blocks. Called with `wrong`, what it writes is not what the
disk keeps.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from engine.files import worker

# What a filter gets before the end; it takes many times as long on a mesh of some thousand faces.
FILTER_SECONDS = 1e-4
# What a block takes from the slow network.
BLOCK_SECONDS = 0.6


def die_inside_filters() -> None:
    """Have the next native filter killed while it runs."""
    load = worker._import_native_code

    def import_native_code() -> None:
        # Not before the pipes are safe: it may print to standard output what it could not load.
        load()
        _make_filters_mortal()

    worker._import_native_code = import_native_code


def _make_filters_mortal() -> None:
    import pymeshlab

    real = pymeshlab.MeshSet.apply_filter

    def apply_filter(*given: Any, **options: Any) -> Any:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, FILTER_SECONDS)
        real(*given, **options)
        # Should a machine be so fast: the end is waited for in native code.
        ctypes.CDLL(None).pause()

    pymeshlab.MeshSet.apply_filter = apply_filter


def crash_inside_readers() -> None:
    """Have native code crash where it reads a file."""
    load = worker._import_native_code

    def import_native_code() -> None:
        load()
        import pymeshlab

        pymeshlab.MeshSet.load_new_mesh = lambda *_, **__: ctypes.string_at(0)

    worker._import_native_code = import_native_code


def be_killed_while_reading() -> None:
    """Have the process killed as soon as it reads a file."""
    from engine.files import importing

    importing.read_whole = lambda *_: os.kill(os.getpid(), signal.SIGKILL)


def write_wrongly() -> None:
    """Have sixty bytes in the middle of every file change while it is written."""
    from engine.files import exporting

    real = exporting.write_as

    def write_as(suffix: str, name: str, *rest: Any) -> None:
        real(suffix, name, *rest)
        data = bytearray(Path(name).read_bytes())
        middle = len(data) // 2
        data[middle : middle + 60] = b"7" * 60
        Path(name).write_bytes(data)

    exporting.write_as = write_as


def read_slowly() -> None:
    """Have every block of a file come late."""
    from engine.files import importing, place

    real = importing.read_whole

    def read_whole(path: Path, name: str, more: Callable[[], None]) -> bytes:
        place.BLOCK = -(-path.stat().st_size // 10)

        def late() -> None:
            time.sleep(BLOCK_SECONDS)
            more()

        return real(path, name, late)

    importing.read_whole = read_whole


def main() -> None:
    """Serve jobs as the file worker does."""
    # Python asks the system to refuse such a write instead.
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    worker.main()


if __name__ == "__main__":
    if sys.argv[1:] == ["filter"]:
        die_inside_filters()
    elif sys.argv[1:] == ["reader"]:
        crash_inside_readers()
    elif sys.argv[1:] == ["killed"]:
        be_killed_while_reading()
    elif sys.argv[1:] == ["wrong"]:
        write_wrongly()
    elif sys.argv[1:] == ["slow"]:
        read_slowly()
    main()
