"""Recent files: those that are gone are not offered, and a disk that is silent holds up nobody."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings

from app.recent import last_folder, recent, remember
from tests.program import PATIENCE


@pytest.fixture
def silent_share(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """A folder whose disk does not say what is in it before the test has ended."""
    share, answer = tmp_path / "share", threading.Event()
    share.mkdir()
    is_file = os.path.isfile

    def waits(path: Path) -> bool:
        if share in Path(path).parents:
            answer.wait(PATIENCE)
        return is_file(path)

    monkeypatch.setattr(os.path, "isfile", waits)
    yield share
    answer.set()


@pytest.fixture
def none_yet(qapp) -> None:
    QSettings().remove("files/recent")


def made(path: Path) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.touch()
    return path.resolve()


def test_the_latest_come_first_and_each_once(none_yet: None, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("app.recent.ANSWER", PATIENCE)
    one, other = made(tmp_path / "a" / "one.ply"), made(tmp_path / "b" / "other.ply")
    for path in (one, other, one):
        remember(path)
    assert recent() == [one, other]
    assert last_folder() == str(one.parent)


def test_a_file_that_is_gone_is_not_offered(none_yet: None, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("app.recent.ANSWER", PATIENCE)
    one, other = made(tmp_path / "a" / "one.ply"), made(tmp_path / "b" / "other.ply")
    remember(one)
    remember(other)
    other.unlink()
    assert recent() == [one]
    assert last_folder() == str(one.parent)
    one.unlink()
    assert recent() == []
    assert last_folder() == str(Path.home())


def test_a_silent_disk_keeps_its_files_in_the_list_and_holds_up_nobody(
    none_yet: None, tmp_path: Path, silent_share: Path
) -> None:
    far = made(silent_share / "far.ply")
    remember(far)
    for _ in range(3):
        assert recent() == [far]
        assert last_folder() == str(Path.home())
    # One look is under way, not one for every time somebody asked.
    assert sum(thread.name == "recent" for thread in threading.enumerate()) == 1
    near = made(tmp_path / "near" / "near.ply")
    remember(near)
    assert recent() == [near, far]
