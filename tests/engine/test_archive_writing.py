"""Writing `.eigenform` files: full disks, no permission, links; the old file is never half gone."""

from __future__ import annotations

import errno
import os
import stat
import sys
from pathlib import Path

import pytest

from engine import Document, EngineError, FileError, History, UnknownStep
from engine.archive import open_archive, save_archive
from engine.files.place import beside
from tests.engine.histories import KINDS, grid, history


def test_a_failed_write_leaves_the_old_file(whole: tuple[bytes, str], tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(whole[0])
    bad = History(Document.open(grid()))
    bad.add(bad.current.with_step(UnknownStep("x", {"t": float("nan")}), bad.current.mesh), "bad")
    with pytest.raises((EngineError, ValueError)):
        save_archive(path, bad.state())
    assert path.read_bytes() == whole[0]
    assert [p.name for p in tmp_path.iterdir()] == ["a.eigenform"]


def test_a_full_disk_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"old")

    def full(_handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match="disk is full"):
        save_archive(path, history().state())
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_what_reads_back_wrong_never_takes_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.eigenform"
    path.write_bytes(b"old")
    real = os.fsync

    def bad_disk(handle: int) -> None:
        os.lseek(handle, -900, os.SEEK_END)
        os.write(handle, b"?" * 8)
        real(handle)

    monkeypatch.setattr(os, "fsync", bad_disk)
    with pytest.raises(FileError, match="reads back wrong"):
        save_archive(path, history().state())
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_no_permission_is_said(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(0o500)
    try:
        if os.access(folder, os.W_OK):
            pytest.skip("this user may write everywhere")
        with pytest.raises(FileError, match="not allowed"):
            save_archive(folder / "a.eigenform", history().state())
    finally:
        folder.chmod(0o700)


def test_absent_folders_and_long_names_are_said(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="folder is not there"):
        save_archive(tmp_path / "absent" / "a.eigenform", history().state())
    with pytest.raises(FileError, match="too long"):
        save_archive(tmp_path / ("n" * 300), history().state())
    with pytest.raises(FileError, match="there is a folder"):
        save_archive(tmp_path, history().state())


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege there")
def test_links_are_followed_and_modes_kept(tmp_path: Path) -> None:
    real, link = tmp_path / "real.eigenform", tmp_path / "link.eigenform"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to(real)
    save_archive(link, history().state())
    assert link.is_symlink()
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert open_archive(real, KINDS).report == ()


def test_what_killed_writers_left_is_swept(tmp_path: Path) -> None:
    with beside(tmp_path / "a.eigenform", ".eigenform") as part:
        ours = part.name
    dead = ours.replace(f"-{os.getpid()}-", f"-{2**22 + 1}-")
    for name in (ours, dead, "mine.part"):
        (tmp_path / name).write_bytes(b"x")
    save_archive(tmp_path / "a.eigenform", history().state())
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([ours, "a.eigenform", "mine.part"])
