"""Recent files, remembered from one start to the next."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSettings

KEPT = 8


def recent() -> list[Path]:
    """Files opened lately that are still there, the latest first."""
    names = QSettings().value("files/recent", [])
    listed = names if isinstance(names, list) else [names] if isinstance(names, str) else []
    return [path for path in map(Path, listed) if path.is_file()]


def remember(path: Path) -> None:
    """Put a file first among the recent ones."""
    resolved = path.resolve()
    others = [one for one in recent() if one != resolved]
    QSettings().setValue("files/recent", [str(p) for p in (resolved, *others)][:KEPT])


def last_folder() -> str:
    """The folder where a file dialog begins."""
    files = recent()
    return str(files[0].parent if files else Path.home())
