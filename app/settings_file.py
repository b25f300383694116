"""Settings file: looked at before Qt opens it, for Qt waits for ever where it is a pipe."""

from __future__ import annotations

import atexit
import shutil
import stat
import sys
import tempfile
from pathlib import Path

from PySide6.QtCore import QSettings, QStandardPaths

from engine.files.report import shown

KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISDIR, "a folder"),
)


def step_round_bad_settings(organization: str, application: str) -> str:
    """Keep settings elsewhere, until the program ends, if what should be their file is none.

    Parameters
    ----------
    organization, application : names of the program, as Qt will be told them.

    Returns
    -------
    A sentence for the person, or "" if nothing is wrong.
    """
    if not sys.platform.startswith("linux"):
        return ""
    where = QStandardPaths.StandardLocation.GenericConfigLocation
    folder = Path(QStandardPaths.writableLocation(where))
    for path in (folder / organization / f"{application}.conf", folder / f"{organization}.conf"):
        kind = _kind_of_no_file(path)
        if kind:
            _keep_elsewhere()
            return (
                f"Settings can neither be read nor kept, since “{shown(str(path))}” is {kind}. "
                "Remove it and start again."
            )
    return ""


def _kind_of_no_file(path: Path) -> str:
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return ""  # Qt does without a file that is not there or not allowed
    return next((name for is_kind, name in KINDS if is_kind(mode)), "")


def _keep_elsewhere() -> None:
    folder = tempfile.mkdtemp(prefix="eigenform-settings-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, folder)
