"""Files written beside and renamed: the target is the old one or the new one, never half of one."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import platform
import re
import secrets
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from engine.errors import FileError
from engine.files.report import shown

_HOST = hashlib.sha256(platform.node().encode()).hexdigest()[:8]
_PART = re.compile(r"\.eigenform-part-([0-9a-f]{8})-(\d+)-[0-9a-f]{8}(\.\w+)?")
_DAY = 86400.0
BLOCK = 1 << 20
"""Bytes that are read at once."""


@contextlib.contextmanager
def beside(target: Path, suffix: str) -> Iterator[Path]:
    """Give a new temporary name in the target's folder; nothing is left there afterwards.

    Raises
    ------
    FileError
        The folder or the target cannot be written to, or the name cannot be one.
    """
    part: Path | None = None
    try:
        folder = real_target(target).parent
        part = folder / f".eigenform-part-{_HOST}-{os.getpid()}-{secrets.token_hex(4)}{suffix}"
        # Taking the name tells at once whether the folder can be written to.
        part.touch(exist_ok=False)
        _refuse_protected(target)
        yield part
    except OSError as error:
        raise FileError(sentence(shown(target.name), error)) from error
    except ValueError as error:
        # A name with a zero byte, or one that the system's encoding does not know.
        raise FileError(f"The name cannot be used ({error}). Choose another name.") from error
    finally:
        if part is not None:
            with contextlib.suppress(OSError):
                part.unlink()


def write_file(target: Path, data: bytes) -> None:
    """Write a small file whole: the old one or the new one stays, whatever happens.

    Raises
    ------
    FileError
        It could not be written; the message says why and what to do.
    """
    with beside(target, target.suffix) as part:
        with part.open("r+b") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        put_in_place(part, target)


def sweep_strays(folder: str | os.PathLike[str]) -> list[Path]:
    """Remove temporary files that killed programs left in `folder`; return which they were.

    Those of a running program stay; those of another computer, on a shared folder, stay for a day.
    """
    swept: list[Path] = []
    with contextlib.suppress(OSError):
        for path in Path(folder).iterdir():
            found = _PART.fullmatch(path.name)
            if found is None or path.is_symlink() or not path.is_file():
                continue
            with contextlib.suppress(OSError):
                old = time.time() - path.stat().st_mtime > _DAY
                if old or (found[1] == _HOST and not _is_running(int(found[2]))):
                    path.unlink()
                    swept.append(path)
    return swept


def _is_running(pid: int) -> bool:
    if os.name == "nt":
        # There the same call would end the process; age alone decides.
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _refuse_protected(target: Path) -> None:
    """Renaming would replace what may not be written, or a device; nobody expects that."""
    if target.exists() and not target.is_dir() and not target.is_file():
        raise FileError(
            f"“{shown(target.name)}” was not saved: what has that name is not an ordinary file. "
            "Choose another name; what was there before is unchanged."
        )
    if target.exists() and not target.is_dir() and not os.access(target, os.W_OK):
        raise FileError(
            f"“{shown(target.name)}” was not saved: the file is write-protected. "
            "Choose another name, or allow writing to it."
        )


def real_target(target: Path) -> Path:
    """Return where a symbolic link leads, so that saving keeps the link and replaces its file."""
    return Path(os.path.realpath(target))


def put_in_place(part: Path, target: Path) -> None:
    """Rename `part` to `target` and push the folder's entry to the disk."""
    goal = real_target(target)
    with contextlib.suppress(FileNotFoundError):
        part.chmod(goal.stat().st_mode & 0o777)
    part.replace(goal)
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


def readable_size(place: Path) -> int:
    """Return the size in bytes of a file that is there, is ordinary and holds something.

    Raises
    ------
    FileError
        It is not; nothing was opened, for a pipe or a device might never answer.
    """
    name = shown(place.name)
    try:
        found = place.stat()
    except (OSError, ValueError) as error:
        raise FileError(reading_sentence(name, error)) from error
    if stat.S_ISDIR(found.st_mode):
        raise FileError(f"“{name}” is a folder. Choose a file in it.")
    if not stat.S_ISREG(found.st_mode):
        raise FileError(f"“{name}” is not an ordinary file. Copy its content into one.")
    if found.st_size == 0:
        raise FileError(f"“{name}” is empty. Export the model again or get another copy.")
    return found.st_size


Stamp = tuple[int, int]
"""What tells that a file was written again: its size, and when, in nanoseconds."""


def stamp_of(place: Path) -> Stamp | None:
    """Return the stamp of a file; None if there is no such file."""
    try:
        found = place.stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def refuse_changed(place: Path, known: Stamp) -> None:
    """Refuse to write over what somebody else wrote since the file had the stamp `known`."""
    now = stamp_of(place)
    if now is not None and now != known:
        raise FileError(
            f"“{shown(place.name)}” was not saved: another window or program has changed the file "
            "since it was opened here. Save under another name to keep both, or choose the same "
            "name in Save as to replace it."
        )


def read_whole(place: Path, name: str, more: Callable[[], None] | None = None) -> bytes:
    """Return what is in a file, if nobody wrote to it meanwhile.

    Parameters
    ----------
    name : what a sentence calls it.
    more : called whenever another block of it has come.

    Raises
    ------
    FileError
        It cannot be read, or it changed while it was read.
    """
    try:
        with place.open("rb") as file:
            before = os.fstat(file.fileno())
            blocks: list[bytes] = []
            while block := file.read(BLOCK):
                blocks.append(block)
                if more is not None:
                    more()
            after = os.fstat(file.fileno())
    except OSError as error:
        raise FileError(reading_sentence(name, error)) from error
    if (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns):
        raise FileError(
            f"“{name}” changed while it was read: another program is writing it. "
            "Open it again when that is done."
        )
    return b"".join(blocks)


def reading_sentence(name: str, error: OSError | ValueError) -> str:
    """Return what to tell the person about `error` while reading `name`."""
    facts = {
        errno.ENOENT: ("is not there", "Look whether it was moved or renamed"),
        errno.ENOTDIR: ("is not there", "Look whether it was moved or renamed"),
        errno.EACCES: ("may not be read by you", "Allow reading it, or copy it from its owner"),
        errno.EPERM: ("may not be read by you", "Allow reading it, or copy it from its owner"),
        errno.EISDIR: ("is a folder", "Choose a file in it"),
        errno.ELOOP: ("is a symbolic link that leads in a circle", "Choose the file itself"),
        errno.EIO: ("cannot be read: the disk or network gave an error", "Try another copy"),
        errno.ESTALE: ("cannot be read: its network folder is gone", "Connect it again"),
        errno.ENAMETOOLONG: ("has too long a name", "Choose a shorter name"),
    }
    number = error.errno if isinstance(error, OSError) else None
    fact, remedy = facts.get(number or 0, (f"cannot be reached ({error})", "Try another place"))
    return f"“{name}” {fact}. {remedy}."


def why_not_written(error: OSError) -> tuple[str, str]:
    """Return what `error` means to whoever wanted to write, and the remedy."""
    facts = {
        errno.ENOSPC: ("the disk is full", "Make room or choose another disk"),
        errno.EDQUOT: ("your share of the disk is full", "Make room or choose another disk"),
        errno.EFBIG: ("the file would be larger than is allowed here", "Choose another disk"),
        errno.EACCES: ("writing is not allowed there", "Choose another folder"),
        errno.EPERM: ("writing is not allowed there", "Choose another folder"),
        errno.EROFS: ("this disk can only be read", "Choose another folder"),
        errno.ENOENT: ("the folder is not there", "Choose another folder"),
        errno.ENOTDIR: ("the folder is not there", "Choose another folder"),
        errno.EEXIST: ("a file is where its folder should be", "Move that file away"),
        errno.EISDIR: ("there is a folder of that name", "Choose another name"),
        errno.ELOOP: ("its symbolic links lead in a circle", "Choose another name"),
        errno.ENAMETOOLONG: ("the name is too long", "Choose a shorter name"),
    }
    return facts.get(error.errno or 0, (str(error), "Choose another place"))


def sentence(name: str, error: OSError) -> str:
    """Return what to tell the person about `error` while saving `name`."""
    fact, remedy = why_not_written(error)
    return f"“{name}” was not saved: {fact}. {remedy}; what was there before is unchanged."
