"""Settings file: what is there in its place holds up no start, and is named."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

import pytest

from tests.program import run_python

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="settings are a file of Qt's on Linux only"
)

# A process of its own: Qt reads the file once in a process, and where settings are kept is global.
ASKED = """
from PySide6.QtCore import QSettings
from app.settings_file import step_round_bad_settings
from app.start import NAME, application
app = application()
print(step_round_bad_settings(NAME, NAME))
print(QSettings().value("look/theme", "none yet"))
QSettings().setValue("look/theme", "light")
QSettings().sync()
print(QSettings().value("look/theme"), QSettings().fileName())
"""


def started(folder: Path) -> list[str]:
    """Return what a start says that keeps its settings below a folder."""
    said = run_python(
        "-c", ASKED, cwd=folder, XDG_CONFIG_HOME=str(folder), QT_QPA_PLATFORM="offscreen"
    )
    assert said.returncode == 0, said.stderr
    return said.stdout.splitlines()


@pytest.mark.parametrize("kind", ["pipe", "socket", "folder", "link to a device"])
def test_what_is_no_file_is_named_and_left_alone(tmp_path: Path, kind: str) -> None:
    bad = tmp_path / "Eigenform" / "Eigenform.conf"
    bad.parent.mkdir()
    if kind == "pipe":
        os.mkfifo(bad)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as made:
            here = Path.cwd()
            os.chdir(bad.parent)  # the name of a socket may not be long
            try:
                made.bind(bad.name)
            finally:
                os.chdir(here)
    elif kind == "folder":
        bad.mkdir()
    else:
        bad.symlink_to("/dev/zero")
    sentence, before, after = started(tmp_path)
    assert kind.rpartition(" ")[2] in sentence
    assert "Eigenform.conf" in sentence
    assert "Remove it" in sentence
    assert before == "none yet"
    assert after.startswith("light ")
    assert str(tmp_path) not in after
    assert not bad.is_file()


def test_the_file_above_all_programs_of_the_maker_is_looked_at_too(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "Eigenform.conf")
    assert "is a pipe" in started(tmp_path)[0]


def test_a_plain_file_is_read_and_kept(tmp_path: Path) -> None:
    assert started(tmp_path)[:2] == ["", "none yet"]
    sentence, before, _after = started(tmp_path)
    assert sentence == ""
    assert before == "light"
    assert (tmp_path / "Eigenform" / "Eigenform.conf").is_file()
