"""Where the program keeps what belongs to no document."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

import resources

_OWN = Path(resources.__file__).resolve().parent


def folder_of(path: Path) -> Path:
    """Return the folder where what comes of a file may go: of our samples the person's own."""
    folder = path.resolve().parent
    return Path.home() if folder.is_relative_to(_OWN) else folder


def state_folder() -> Path:
    """Return the folder of journals and crash reports; `EIGENFORM_STATE` names another one."""
    named = os.environ.get("EIGENFORM_STATE")
    return Path(named) if named else platformdirs.user_state_path("eigenform", appauthor=False)
