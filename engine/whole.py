"""Files that are either the old one or the new one, never half: written beside, then renamed."""

from __future__ import annotations

import errno
import os
import secrets
import sys
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import psutil

from engine.errors import FileError

ENDING = ".part"

_REASONS = {
    errno.ENOSPC: "the disk is full. Free some space or choose another disk",
    errno.EDQUOT if hasattr(errno, "EDQUOT") else -1: "your quota of disk space is used up. "
    "Free some space or choose another disk",
    errno.EACCES: "there is no permission to write there. Choose another folder",
    errno.EPERM: "there is no permission to write there. Choose another folder",
    errno.EROFS: "the disk is read-only. Choose another folder",
    errno.ENOENT: "its folder does not exist. Choose another folder",
    errno.ENOTDIR: "its folder is not a folder. Choose another one",
    errno.EISDIR: "it is a folder. Choose another name",
    errno.ENAMETOOLONG: "its name is too long. Choose a shorter one",
    errno.EFBIG: "it is too large for this disk. Choose another disk",
}


def write_failure(path: Path, error: OSError) -> FileError:
    """Say in words why a file could not be written, and that the old one is untouched."""
    reason = _REASONS.get(error.errno or 0, f"{error.strerror or error}. Try another folder")
    return FileError(f"“{path.name}” could not be written: {reason}. What was there is unchanged.")


def write_whole(
    path: Path, write: Callable[[BinaryIO], None], check: Callable[[Path], None] | None = None
) -> None:
    """Write a file so that a kill, a full disk or a failed check leave the old one as it was.

    Parameters
    ----------
    path : where the file shall be; a symbolic link is followed, so that its target is replaced.
    write : writes the bytes to a file open for writing and reading.
    check : reads the new file back before it takes the name; raises `EngineError` if it is wrong.

    Raises
    ------
    FileError
        The file cannot be written; the message says why.
    """
    try:
        target = path.resolve()
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, "it is a folder")
        sweep_parts(target.parent, target.name)
        part = target.parent / f".{target.name[:50]}.{os.getpid()}-{secrets.token_hex(4)}{ENDING}"
    except OSError as error:
        raise write_failure(path, error) from error
    try:
        with part.open("x+b") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        if check is not None:
            check(part)
        if target.exists():
            part.chmod(target.stat().st_mode & 0o7777)
        part.replace(target)
        sync_folder(target.parent)
    except OSError as error:
        raise write_failure(path, error) from error
    finally:
        part.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder survive a power cut, where the system can."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        # Some network file systems cannot sync a folder; the file itself is flushed already.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EBADF):
            raise
    finally:
        os.close(handle)


def sweep_parts(folder: Path, name: str = "") -> int:
    """Remove what writers that were killed have left in a folder, and return how many.

    Only files named as `write_whole` names them, whose process is gone.
    """
    swept = 0
    for part in folder.glob(".*" + ENDING):
        kept_name, _, rest = part.name[1 : -len(ENDING)].rpartition(".")
        pid = rest.partition("-")[0]
        if not (kept_name and pid.isdecimal()) or (name and kept_name != name[:50]):
            continue
        if not psutil.pid_exists(int(pid)) and part.is_file():
            part.unlink(missing_ok=True)
            swept += 1
    return swept
