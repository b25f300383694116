"""Locks on open files that the system lifts when their program ends, however it ends."""

from __future__ import annotations

import errno
import sys
from typing import BinaryIO

_HELD = (errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK, errno.EDEADLK)


def try_lock(file: BinaryIO) -> bool | None:
    """Lock an open file against every other handle, without waiting.

    Returns
    -------
    True when it is locked now, False when another handle has it, None where the file system knows
    no locks.
    """
    try:
        _lock(file)
    except OSError as error:
        return False if error.errno in _HELD else None
    return True


if sys.platform == "win32":
    import msvcrt

    def _lock(file: BinaryIO) -> None:
        # The locked byte lies far behind the end, since a locked one cannot be read there.
        at = file.tell()
        file.seek(2**40)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        finally:
            file.seek(at)

else:
    import fcntl

    def _lock(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
