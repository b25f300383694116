"""Where the program keeps what belongs to no document."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs


def state_folder() -> Path:
    """Return the folder of journals and crash reports; `EIGENFORM_STATE` names another one."""
    named = os.environ.get("EIGENFORM_STATE")
    return Path(named) if named else platformdirs.user_state_path("eigenform", appauthor=False)
