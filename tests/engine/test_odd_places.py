"""Files that are no files, names that are hardly names, and disks that fail, at every door."""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from engine import FileError, open_file, save
from engine import journal as journal_module
from engine import scribe as scribe_module
from engine.archive import open_archive, save_archive
from engine.files.place import read_whole
from engine.files.process import worker
from engine.journal import Journal, recover
from engine.scribe import Scribe
from tests.engine.histories import KINDS, fingerprint, history
from tests.engine.test_io_save import IS_ROOT, mounted
from tests.soak.export_kills import sheet

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and links are of POSIX")

OPEN: dict[str, Callable[[Path], object]] = {
    ".obj": open_file,
    ".eigenform": lambda path: open_archive(path, KINDS),
}
SAVE: dict[str, Callable[[Path], object]] = {
    ".obj": lambda path: save(sheet(0, 9), path),
    ".eigenform": lambda path: save_archive(path, history().state()),
}
ENDINGS = list(OPEN)


def told(act: Callable[[Path], object], path: Path) -> str:
    """The refusal, which names the file and gives a fact and a remedy."""
    with pytest.raises(FileError) as refusal:
        act(path)
    words = str(refusal.value)
    assert path.name in words
    assert words.count(". ") >= 1
    assert words.endswith(".")
    assert "Errno" not in words
    words.encode()
    return words


@pytest.fixture
def socket_at() -> Iterator[Callable[[Path], None]]:
    """Makes sockets, which have a name like a file."""
    made: list[socket.socket] = []

    def make(path: Path) -> None:
        one = socket.socket(socket.AF_UNIX)
        made.append(one)
        # The name of a socket must be short: it is given from where it shall be.
        home = Path.cwd()
        try:
            os.chdir(path.parent)
            one.bind(path.name)
        finally:
            os.chdir(home)

    yield make
    for one in made:
        one.close()


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_no_file_is_refused_and_never_waited_for(
    ending: str, tmp_path: Path, socket_at: Callable[[Path], None]
) -> None:
    pipe, plug, folder, link = (tmp_path / f"{n}{ending}" for n in ("pipe", "plug", "dir", "loop"))
    os.mkfifo(pipe)
    socket_at(plug)
    folder.mkdir()
    link.symlink_to(link)
    assert "is not an ordinary file" in told(OPEN[ending], pipe)
    assert "is not an ordinary file" in told(OPEN[ending], plug)
    assert "is a folder" in told(OPEN[ending], folder)
    assert "leads in a circle" in told(OPEN[ending], link)
    assert "is not there" in told(OPEN[ending], tmp_path / f"none{ending}")
    assert "is not there" in told(OPEN[ending], pipe / f"below{ending}")
    assert "too long a name" in told(OPEN[ending], tmp_path / ("n" * 300 + ending))


@pytest.mark.parametrize("ending", ENDINGS)
def test_devices_are_refused(ending: str, tmp_path: Path) -> None:
    for name in ("zero", "null", "full"):
        path = tmp_path / f"{name}{ending}"
        path.symlink_to(f"/dev/{name}")
        assert "is not an ordinary file" in told(OPEN[ending], path)


@pytest.mark.parametrize("ending", ENDINGS)
def test_nothing_is_saved_over_what_is_no_file(
    ending: str, tmp_path: Path, socket_at: Callable[[Path], None]
) -> None:
    pipe, plug, link = (tmp_path / f"{n}{ending}" for n in ("pipe", "plug", "link"))
    os.mkfifo(pipe)
    socket_at(plug)
    link.symlink_to(pipe)
    loop = tmp_path / f"loop{ending}"
    loop.symlink_to(loop)
    before = sorted(p.name for p in tmp_path.iterdir())
    for path in (pipe, plug, link):
        assert "is not an ordinary file" in told(SAVE[ending], path)
    assert "lead in a circle" in told(SAVE[ending], loop)
    assert pipe.is_fifo()
    assert plug.is_socket()
    assert link.is_symlink()
    assert loop.is_symlink()
    assert sorted(p.name for p in tmp_path.iterdir()) == before


NAMES = [
    "line\nbreak", 'it\'s "quoted"', "100%s %d {x} $HOME", b"\xff\xfe\x80", "…“”", "-rf", "a" * 240,
    "\u202ejbo.moc", " lead", "tab\there", "<b>bold<b>", "&amp;", "bell\a", "CON", "käfer",
]  # fmt: skip


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_every_name_is_saved_opened_and_told_on_one_line(
    name: str | bytes, ending: str, tmp_path: Path
) -> None:
    path = tmp_path / (os.fsdecode(name) + ending)
    SAVE[ending](path)
    OPEN[ending](path)
    path.write_bytes(b"something else\n")
    with pytest.raises(FileError) as refusal:
        OPEN[ending](path)
    words = str(refusal.value)
    words.encode()
    assert words.isprintable()


def test_a_file_that_is_written_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "growing.obj"
    path.write_bytes(b"# a line\n" * 400_000)
    stop = threading.Event()

    def grow() -> None:
        with path.open("ab", buffering=0) as file:
            while not stop.is_set():
                file.write(b"# one more\n")

    writer = threading.Thread(target=grow)
    writer.start()

    def read_often() -> None:
        for _ in range(100):
            read_whole(path, path.name)

    try:
        with pytest.raises(FileError, match="another program is writing it") as refusal:
            read_often()
    finally:
        stop.set()
        writer.join(30)
    assert "growing.obj" in str(refusal.value)
    assert read_whole(path, path.name) == path.read_bytes()


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (lambda path: path.unlink(), "is not there"),
        (lambda path: (path.unlink(), path.mkdir()), "is a folder"),
    ],
    ids=["vanishes", "becomes a folder"],
)
def test_a_file_that_goes_between_the_dialog_and_the_reading(
    change: Callable[[Path], Any], fact: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "gone.obj"
    save(sheet(0, 9), path)
    ask = worker.ask

    def too_late(*given: Any) -> Any:
        change(path)
        return ask(*given)

    monkeypatch.setattr(worker, "ask", too_late)
    assert fact in told(open_file, path)


@pytest.mark.skipif(IS_ROOT, reason="root may read everything")
@pytest.mark.parametrize("ending", ENDINGS)
def test_a_file_that_may_not_be_read_is_named(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"secret{ending}"
    SAVE[ending](path)
    path.chmod(0)
    assert "may not be read" in told(OPEN[ending], path)


# ---- two windows on one document


def test_what_another_window_saved_is_not_saved_over_unasked(tmp_path: Path) -> None:
    path = tmp_path / "a.eigenform"
    mine, theirs = history(steps=1).state(), history(steps=2).state()
    stamp = save_archive(path, mine)
    assert open_archive(path, KINDS).stamp == stamp
    os.utime(path, (1, 1))
    moved = open_archive(path, KINDS).stamp
    save_archive(path, theirs)
    with pytest.raises(FileError, match="another window or program has changed"):
        save_archive(path, mine, known=moved)
    assert fingerprint(open_archive(path, KINDS).state) == fingerprint(theirs)
    assert [p.name for p in tmp_path.iterdir()] == ["a.eigenform"]
    newest = open_archive(path, KINDS).stamp
    again = save_archive(path, mine, known=newest)
    assert save_archive(path, theirs, known=again) is not None
    # One that was thrown away meanwhile is written anew.
    stamp = open_archive(path, KINDS).stamp
    path.unlink()
    save_archive(path, mine, known=stamp)
    assert fingerprint(open_archive(path, KINDS).state) == fingerprint(mine)


# ---- disks


def test_a_document_on_a_disk_that_can_only_be_read(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "size=4m") as disk:
        path = disk / "a.eigenform"
        state = history().state()
        save_archive(path, state)
        assert os.system(f"mount -o remount,ro '{disk}'") == 0
        assert fingerprint(open_archive(path, KINDS).state) == fingerprint(state)
        assert "can only be read" in told(SAVE[".eigenform"], path)
        assert recover(disk, KINDS) == []
        with pytest.raises(FileError, match="can only be read"):
            Journal(disk)


def test_a_file_in_the_place_of_the_journals_is_told(tmp_path: Path) -> None:
    (tmp_path / "journals").write_text("")
    with pytest.raises(FileError, match="a file is where its folder should be") as refusal:
        Journal(tmp_path / "journals")
    assert "Errno" not in str(refusal.value)


def test_a_disk_that_fills_while_the_journal_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scribe_module, "RETRY_SECONDS", 0.0)
    said: list[str] = []
    with mounted(tmp_path / "disk", "size=256k") as disk:
        folder = disk / "journals"
        begun = history()
        scribe = Scribe(folder, said.append)
        scribe.begin(begun.state(), safe=False)
        assert scribe.flush()
        marks = [fingerprint(begun.state())]
        room = os.statvfs(disk)
        (disk / "film").write_bytes(bytes(room.f_bavail * room.f_frsize))
        # What is left of the file's last block takes a state or two.
        for number in range(40):
            begun.add(begun.current.with_region(f"r{number}", history().current.draft.roi), "R")
            marks.append(fingerprint(begun.state()))
            scribe.write(begun.state())
            assert scribe.flush()
        assert len(said) == 1
        assert "disk is full" in said[0]
        assert "Save often" in said[0], "what the person can do"
        # Killed now, what was written before the disk was full is there.
        kept = list(folder.glob("*.journal"))
        copies = tmp_path / "copies"
        copies.mkdir()
        for path in kept:
            (copies / path.name).write_bytes(path.read_bytes())
        (before,) = recover(copies, KINDS)
        before.release()
        assert fingerprint(before.state) in marks[:-1]
        (disk / "film").unlink()
        begun.add(begun.current, "After")
        scribe.write(begun.state())
        assert scribe.flush()
        assert said[1:] == [""]
        scribe.end("closed")
        scribe.stop()
        (newest, *_) = recover(folder, KINDS)
        assert fingerprint(newest.state) == fingerprint(begun.state())
        newest.release()


# ---- clocks and locks


def test_a_clock_that_was_set_back_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = time.time()
    begun = history()
    journal = Journal(tmp_path)
    monkeypatch.setattr(journal_module.time, "time", lambda: now + 10 * 365 * 86400)
    journal.write(begun.state())
    monkeypatch.setattr(journal_module.time, "time", lambda: now - 10 * 365 * 86400)
    begun.add(begun.current, "Later, said to be earlier")
    journal.write(begun.state())
    journal.closed("set aside")
    journal.keep()
    (found,) = recover(tmp_path, KINDS)
    assert fingerprint(found.state) == fingerprint(begun.state())
    found.release()


def test_without_locks_the_number_of_the_process_tells_whose_a_journal_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_module, "try_lock", lambda _file: None)
    journal = Journal(tmp_path)
    journal.write(history().state())
    assert recover(tmp_path, KINDS) == [], "this very process lives"
    journal.abandon()
    dead = journal.path.name.replace(f"-{os.getpid()}-", f"-{2**22 + 1}-")
    journal.path.rename(tmp_path / dead)
    (found,) = recover(tmp_path, KINDS)
    found.discard()
