"""Files written beside and renamed: the target is the old one or the new one, never half of one."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import platform
import re
import secrets
import time
from collections.abc import Iterator
from pathlib import Path

from engine.errors import FileError
from engine.files.report import shown

_HOST = hashlib.sha256(platform.node().encode()).hexdigest()[:8]
_PART = re.compile(r"\.eigenform-part-([0-9a-f]{8})-(\d+)-[0-9a-f]{8}(\.\w+)?")
_DAY = 86400.0


@contextlib.contextmanager
def beside(target: Path, suffix: str) -> Iterator[Path]:
    """Give a new temporary name in the target's folder; nothing is left there afterwards."""
    part: Path | None = None
    try:
        folder = real_target(target).parent
        part = folder / f".eigenform-part-{_HOST}-{os.getpid()}-{secrets.token_hex(4)}{suffix}"
        _refuse_protected(target)
        # Taking the name tells at once whether the folder can be written to.
        part.touch(exist_ok=False)
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
        part.write_bytes(data)
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
    """Renaming would replace a write-protected file without asking; nobody expects that."""
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


def sentence(name: str, error: OSError) -> str:
    """Return what to tell the person about `error` while saving `name`."""
    facts = {
        errno.ENOSPC: ("the disk is full", "Make room or choose another disk"),
        errno.EDQUOT: ("your share of the disk is full", "Make room or choose another disk"),
        errno.EFBIG: ("the file would be larger than is allowed here", "Choose another disk"),
        errno.EACCES: ("writing is not allowed there", "Choose another folder"),
        errno.EPERM: ("writing is not allowed there", "Choose another folder"),
        errno.EROFS: ("this disk can only be read", "Choose another folder"),
        errno.ENOENT: ("the folder is not there", "Choose another folder"),
        errno.ENOTDIR: ("the folder is not there", "Choose another folder"),
        errno.EISDIR: ("there is a folder of that name", "Choose another name"),
        errno.ENAMETOOLONG: ("the name is too long", "Choose a shorter name"),
    }
    fact, remedy = facts.get(error.errno or 0, (str(error), "Choose another place"))
    return f"“{name}” was not saved: {fact}. {remedy}; what was there before is unchanged."
