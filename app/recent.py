"""Recent files, remembered from one start to the next."""

from __future__ import annotations

import os
from pathlib import Path

from PySide6.QtCore import QSettings

KEPT = 8
BYTES = "bytes:"
"""Begins an entry that is the hexadecimal bytes of a name which is no text; no path begins so."""


def recent() -> list[Path]:
    """Files opened lately that are still there, the latest first."""
    names = QSettings().value("files/recent", [])
    listed = names if isinstance(names, list) else [names] if isinstance(names, str) else []
    # Path.is_file raises where a folder may not be entered or its network is gone.
    return [path for path in map(_path, listed) if path is not None and os.path.isfile(path)]  # noqa: PTH113


def remember(path: Path) -> None:
    """Put a file first among the recent ones."""
    resolved = path.resolve()
    others = [one for one in recent() if one != resolved]
    QSettings().setValue("files/recent", [_entry(p) for p in (resolved, *others)][:KEPT])


def last_folder() -> str:
    """The folder where a file dialog begins."""
    files = recent()
    return str(files[0].parent if files else Path.home())


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
