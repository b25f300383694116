"""Files written beside and renamed: the target is the old one or the new one, never half of one."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from engine.errors import FileError

PREFIX = ".eigenform-part-"


@contextlib.contextmanager
def beside(target: Path, suffix: str) -> Iterator[Path]:
    """Give a new temporary name in the target's folder; nothing is left there afterwards."""
    folder = real_target(target).parent
    part = folder / f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}{suffix}"
    try:
        # Taking the name tells at once whether the folder can be written to.
        part.touch(exist_ok=False)
        yield part
    except OSError as error:
        raise FileError(sentence(target, error)) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def real_target(target: Path) -> Path:
    """Return where a symbolic link leads, so that saving keeps the link and replaces its file."""
    return Path(os.path.realpath(target))


def put_in_place(part: Path, target: Path) -> None:
    """Rename `part` to `target` and push the folder's entry to the disk."""
    goal = real_target(target)
    with contextlib.suppress(FileNotFoundError):
        os.chmod(part, goal.stat().st_mode & 0o777)
    os.replace(part, goal)
    push_folder(goal.parent)


def push_folder(folder: Path) -> None:
    """Make a rename in `folder` survive a power cut, where the system can do so."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems have no such thing; the rename itself is done.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def sentence(target: Path, error: OSError) -> str:
    """Return what to tell the person about `error` while saving `target`."""
    facts = {
        errno.ENOSPC: ("the disk is full", "Make room or choose another disk"),
        errno.EDQUOT: ("your share of the disk is full", "Make room or choose another disk"),
        errno.EFBIG: ("the file would be larger than is allowed here", "Choose another disk"),
        errno.EACCES: ("this folder may not be written to", "Choose another folder"),
        errno.EPERM: ("this folder may not be written to", "Choose another folder"),
        errno.EROFS: ("this disk can only be read", "Choose another folder"),
        errno.ENOENT: ("the folder is not there", "Choose another folder"),
        errno.ENOTDIR: ("the folder is not there", "Choose another folder"),
        errno.EISDIR: ("there is a folder of that name", "Choose another name"),
        errno.ENAMETOOLONG: ("the name is too long", "Choose a shorter name"),
    }
    fact, remedy = facts.get(error.errno or 0, (str(error), "Choose another place"))
    return f"“{target.name}” was not saved: {fact}. {remedy}; what was there before is unchanged."
