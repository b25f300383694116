"""A folder for what native code shall read, gone afterwards even if that code crashes."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path


def scratch_folder() -> tempfile.TemporaryDirectory[str]:
    """Make an empty folder for this process; leaving its context removes it."""
    return tempfile.TemporaryDirectory(prefix=_prefix(os.getpid()))


def sweep_scratch(pid: int) -> None:
    """Remove what the ended process `pid` could not: copies of a stranger's file."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_prefix(pid)}*"):
        shutil.rmtree(folder, ignore_errors=True)


def _prefix(pid: int) -> str:
    return f"eigenform-{pid}-"
