"""Recent files, remembered from one start to the next."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QSettings

from app.places import folder_of

KEPT = 8
BYTES = "bytes:"
"""Begins an entry that is the hexadecimal bytes of a name which is no text; no path begins so."""


ANSWER = 0.04
"""Seconds that the window waits for a disk to say which files are there: a share that is gone
answers after half a minute."""

_asked: dict[Path, threading.Thread] = {}


def recent() -> list[Path]:
    """Files opened lately, the latest first, without those that are known to be gone."""
    listed = _remembered()
    found = _looked_at(listed)
    return [path for path in listed if found.get(path, True)]


def remember(path: Path) -> None:
    """Put a file first among the recent ones."""
    resolved = path.resolve()
    others = [one for one in recent() if one != resolved]
    QSettings().setValue("files/recent", [_entry(p) for p in (resolved, *others)][:KEPT])


def last_folder() -> str:
    """The folder where a file dialog begins: that of the latest file that is there."""
    listed = _remembered()
    found = _looked_at(listed)
    there = next((path for path in listed if found.get(path, False)), None)
    return str(Path.home() if there is None else folder_of(there))


def _remembered() -> list[Path]:
    names = QSettings().value("files/recent", [])
    listed = names if isinstance(names, list) else [names] if isinstance(names, str) else []
    return [path for path in map(_path, listed) if path is not None]


def _looked_at(paths: Sequence[Path]) -> dict[Path, bool]:
    """Return for each path whether it is a file; one whose disk does not answer is left out."""
    found: dict[Path, bool] = {}

    def look(path: Path) -> None:
        # Path.is_file raises where a folder may not be entered or its network is gone.
        found[path] = os.path.isfile(path)  # noqa: PTH113

    threads = []
    for path in paths:
        if path in _asked and _asked[path].is_alive():
            continue  # its disk still owes the answer of last time
        thread = _asked[path] = threading.Thread(
            target=look, args=(path,), name="recent", daemon=True
        )
        thread.start()
        threads.append(thread)
    end = time.monotonic() + ANSWER
    for thread in threads:
        thread.join(max(end - time.monotonic(), 0))
    return dict(found)


def _entry(path: Path) -> str:
    """Return what settings, which keep text only, remember of a path."""
    name = str(path)
    try:
        name.encode()
    except UnicodeEncodeError:
        return BYTES + os.fsencode(path).hex()
    return name


def _path(entry: object) -> Path | None:
    name = str(entry)
    if not name.startswith(BYTES):
        return Path(name)
    try:
        return Path(os.fsdecode(bytes.fromhex(name.removeprefix(BYTES))))
    except ValueError:
        return None
