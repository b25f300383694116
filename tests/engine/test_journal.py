"""The journal: after a kill at any moment at most the last stroke is gone; damage costs little."""

from __future__ import annotations

import os
import random
import sys
import threading
import time
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from engine import Document, EngineError, FileError, History, HistoryState, UnknownStep
from engine import journal as journal_module
from engine import pusher as pusher_module
from engine import scribe as scribe_module
from engine.journal import Journal, Recoverable, Why, recover
from engine.records import HEAD, append_record, read_records
from engine.scribe import Scribe
from tests.engine.histories import KINDS, fingerprint, grid, history
from tests.engine.scripted_session import states
from tests.killing import lines_until_killed


def abandoned(folder: Path, state: HistoryState) -> Path:
    """Write a journal and let go of it as a program does that is killed."""
    journal = Journal(folder)
    journal.write(state)
    journal._file.close()
    return journal.path


def one(folder: Path) -> Recoverable:
    """The only document that can be restored; its journal is let go of."""
    (found,) = recover(folder, KINDS)
    found.release()
    return found


# ---- what is offered


def test_a_killed_program_leaves_everything(tmp_path: Path) -> None:
    state = history().state()
    abandoned(tmp_path, state)
    found = one(tmp_path)
    assert fingerprint(found.state) == fingerprint(state)
    assert (found.why, found.name, found.saved_to, found.report) == ("crash", "käfer.obj", "", ())
    assert abs(found.time - time.time()) < 60


def test_only_changes_are_written(tmp_path: Path) -> None:
    begun = History(Document.open(grid(100)))
    journal = Journal(tmp_path)
    journal.write(begun.state())
    whole = journal.path.stat().st_size
    for level in np.linspace(0, 1, 50):
        draft = begun.current.draft.__class__(np.arange(300), float(level))
        begun.add(begun.current.with_draft(draft), "Level")
        journal.write(begun.state())
        journal.write(begun.state())
    grown = journal.path.stat().st_size - whole
    journal.remove()
    assert grown < 0.5 * whole
    assert list(tmp_path.iterdir()) == []


def test_a_running_program_is_left_alone(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.write(history().state())
    assert recover(tmp_path, KINDS) == []
    assert journal.path.exists()
    journal.remove()


def test_what_is_offered_once_is_not_offered_elsewhere(tmp_path: Path) -> None:
    abandoned(tmp_path, history().state())
    (first,) = recover(tmp_path, KINDS)
    assert recover(tmp_path, KINDS) == []
    first.discard()
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_offered_when_nothing_is_lost(tmp_path: Path) -> None:
    begun = history()
    state = begun.state()
    journal = Journal(tmp_path)
    journal.write(state)
    journal.saved("x.eigenform", state)
    journal._file.close()
    assert recover(tmp_path, KINDS) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("order", ["change before the note", "change after the note"])
def test_changes_since_saving_are_offered(order: str, tmp_path: Path) -> None:
    begun = history()
    saved = begun.state()
    journal = Journal(tmp_path)
    journal.write(saved)
    begun.add(begun.current.with_region("late", np.arange(3)), "Late")
    if order == "change before the note":
        journal.write(begun.state())
        journal.saved("/x/y.eigenform", saved)
    else:
        journal.saved("/x/y.eigenform", saved)
        journal.write(begun.state())
    journal._file.close()
    found = one(tmp_path)
    assert found.saved_to == "/x/y.eigenform"
    assert fingerprint(found.state) == fingerprint(begun.state())


def test_an_impossible_moment_that_was_taken_back_stays_away(tmp_path: Path) -> None:
    begun = history()
    journal = Journal(tmp_path)
    begun.add(begun.current, "Impossible")
    journal.write(begun.state())
    begun.take_back()
    journal.write(begun.state())
    journal._file.close()
    assert fingerprint(one(tmp_path).state) == fingerprint(begun.state())


def test_closed_and_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reasons: tuple[Why, ...] = ("closed", "set aside")
    for why in reasons:
        journal = Journal(tmp_path)
        journal.write(history().state())
        journal.closed(why)
        journal.keep()
    found = recover(tmp_path, KINDS)
    assert sorted(entry.why for entry in found) == ["closed", "set aside"]
    for entry in found:
        entry.release()
    later = time.time() + 8 * 86400
    monkeypatch.setattr(journal_module.time, "time", lambda: later)
    assert one(tmp_path).why == "closed"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_newer_version_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_module, "FORMAT_VERSION", 2)
    path = abandoned(tmp_path, history().state())
    monkeypatch.undo()
    assert recover(tmp_path, KINDS) == []
    assert path.exists()


def test_a_journal_that_was_just_begun_is_not_taken_for_a_dead_one(tmp_path: Path) -> None:
    path = tmp_path / "20260101-000000-1-aa.journal"
    path.touch()
    assert recover(tmp_path, KINDS) == []
    assert path.exists()
    os.utime(path, (0, 0))
    recover(tmp_path, KINDS)
    assert not path.exists()


def test_an_absent_folder_has_nothing(tmp_path: Path) -> None:
    assert recover(tmp_path / "absent", KINDS) == []


def test_a_long_journal_is_written_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_module, "REWRITE_ABOVE", 20_000)
    begun = history()
    journal = Journal(tmp_path)
    sizes = []
    for k in range(200):
        document = begun.current.with_region("same", np.arange(k % 16 + 1))
        begun.amend(document)
        journal.write(begun.state())
        sizes.append(journal.path.stat().st_size)
    assert max(sizes) < 60_000
    assert len(list(tmp_path.iterdir())) > 1
    # Killed before the last one is on the disk: what it stands for is not offered beside it.
    journal.abandon()
    assert fingerprint(one(tmp_path).state) == fingerprint(begun.state())
    assert len(list(tmp_path.iterdir())) == 1


def test_a_journal_written_anew_keeps_its_file_and_the_old_one_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_module, "REWRITE_ABOVE", 0)
    begun = history()
    journal = Journal(tmp_path)
    journal.belongs_to("/x/y.eigenform", (3, 4))
    for k in range(5):
        begun.amend(begun.current.with_region("same", np.arange(k + 1)))
        journal.write(begun.state())
    journal.sync()
    assert list(tmp_path.iterdir()) == [journal.path]
    journal.abandon()
    found = one(tmp_path)
    assert (found.saved_to, found.stamp) == ("/x/y.eigenform", (3, 4))
    assert fingerprint(found.state) == fingerprint(begun.state())


# ---- damage


STRIDES = [pytest.param(97), pytest.param(1, marks=pytest.mark.soak)]


def check_sound(found: list[Recoverable]) -> None:
    for entry in found:
        for moment in entry.state.moments.values():
            assert np.isfinite(moment.document.mesh.vertices).all()
            assert moment.document.mesh.faces.max() < moment.document.mesh.n
        entry.release()


@pytest.mark.parametrize("stride", STRIDES)
def test_cut_off_anywhere(stride: int, tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    ends, marks = [], []
    for state in islice(states(3), 12):
        journal.write(state)
        ends.append(journal.path.stat().st_size)
        marks.append(fingerprint(state))
    journal._file.close()
    data = journal.path.read_bytes()
    for length in [*range(0, len(data), max(1, stride * len(data) // 15_000)), len(data)]:
        journal.path.write_bytes(data[:length])
        found = recover(tmp_path, KINDS)
        whole = [mark for end, mark in zip(ends, marks, strict=True) if end <= length]
        # Before the end of the first state there may be something or nothing.
        if whole:
            assert [fingerprint(entry.state) for entry in found] == whole[-1:]
            assert found[0].report == ()
        check_sound(found)


@pytest.mark.parametrize("stride", STRIDES)
def test_one_bit_flipped_anywhere(stride: int, tmp_path: Path) -> None:
    state = history().state()
    path = abandoned(tmp_path, state)
    data = path.read_bytes()
    dice = random.Random(7)
    told = whole = lost = 0
    for at in range(0, len(data), stride):
        flipped = bytearray(data)
        flipped[at] ^= 1 << dice.randrange(8)
        path.write_bytes(flipped)
        found = recover(tmp_path, KINDS)
        check_sound(found)
        lost += not found
        for entry in found:
            same = fingerprint(entry.state) == fingerprint(state)
            assert same or entry.report
            told += not same
            whole += same
    # Only what hits the original surface itself may cost the whole document.
    assert lost < 0.35 * (told + whole + lost)


def test_junk_between_records_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "records"
    dice = random.Random(8)
    payloads = [dice.randbytes(dice.randrange(5000)) for _ in range(30)]
    with path.open("wb", buffering=0) as file:
        for payload in payloads:
            file.write(dice.randbytes(dice.randrange(100)))
            append_record(file, 7, payload)
        file.write(b"\xe1gnF" * 300)
    assert [payload for kind, payload in read_records(path) if kind == 7] == payloads


def test_records_across_the_blocks_of_a_search(tmp_path: Path) -> None:
    path = tmp_path / "records"
    for before in (2**20 - 3, 2**20, 2**20 + 1, 2**21 - 2):
        with path.open("wb", buffering=0) as file:
            file.write(bytes(before))
            append_record(file, 1, b"here")
        assert list(read_records(path))[-1] == (1, b"here")
        assert path.stat().st_size == before + HEAD + 4


# ---- the scribe


def test_a_disk_that_hangs_is_waited_for_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scribe_module, "PATIENCE", 0.01)
    hanging, free = threading.Event(), threading.Event()
    free.set()
    real = journal_module.append_record

    def append(file: BinaryIO, kind: int, payload: bytes) -> None:
        if not free.is_set():
            hanging.set()
            assert free.wait(60)
        real(file, kind, payload)

    monkeypatch.setattr(journal_module, "append_record", append)
    scribe = Scribe(tmp_path)
    begun = History(Document.open(grid(30)))
    scribe.begin(begun.state(), safe=False)
    assert scribe.flush()
    free.clear()
    for k in range(30):
        begun.add(begun.current.with_region(f"r{k}", np.arange(3)), "R")
        scribe.write(begun.state())
        assert hanging.wait(60)
        assert scribe._behind == (k > 0)
    # Nothing of what waits is written twice: the newest stands for all.
    assert [kind for kind, _do in scribe._orders] == ["write"]
    free.set()
    assert scribe.flush(60)
    assert not scribe._behind
    scribe.end("crash")
    scribe.stop()
    assert fingerprint(one(tmp_path).state) == fingerprint(begun.state())


def test_a_state_is_handed_over_once_the_one_before_is_written(tmp_path: Path) -> None:
    scribe = Scribe(tmp_path)
    before: HistoryState | None = None
    for number, state in enumerate(islice(states(6), 60)):
        if number == 0:
            scribe.begin(state, "scripted.obj")
        else:
            scribe.write(state)
        if before is not None and number > 1:
            assert scribe._journal is not None
            written = set(scribe._journal._written)
            assert set(before.moments) & set(state.moments) <= written
        before = state
    scribe.end()
    scribe.stop()


def test_a_push_that_takes_long_holds_no_state_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pusher_module, "QUIET", 0.0)
    pushing, free = threading.Event(), threading.Event()

    def fsync(_file: int) -> None:
        pushing.set()
        assert free.wait(60)

    monkeypatch.setattr(journal_module.os, "fsync", fsync)
    monkeypatch.setattr(scribe_module, "PATIENCE", 60.0)
    scribe = Scribe(tmp_path)
    begun = history()
    scribe.begin(begun.state(), safe=False)
    assert pushing.wait(60)
    for _ in range(20):
        begun.add(begun.current, "A")
        scribe.write(begun.state())
    scribe.write(begun.state())
    assert scribe._journal is not None
    copies = tmp_path / "copies"
    copies.mkdir()
    (copies / "as-killed-1-aa.journal").write_bytes(scribe._journal.path.read_bytes())
    assert fingerprint(one(copies).state) == fingerprint(begun.state())
    free.set()
    scribe.end()
    scribe.stop()


def test_a_push_that_fails_is_said_and_begun_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pusher_module, "QUIET", 0.0)
    monkeypatch.setattr(scribe_module, "RETRY_SECONDS", 0.0)
    said: list[str] = []
    told = threading.Event()

    def problem(sentence: str) -> None:
        said.append(sentence)
        told.set()

    def fsync(_file: int) -> None:
        raise OSError(5, "Input/output error")

    scribe = Scribe(tmp_path, problem)
    begun = history()
    with monkeypatch.context() as broken:
        broken.setattr(journal_module.os, "fsync", fsync)
        scribe.begin(begun.state(), safe=False)
        assert told.wait(60)
    begun.add(begun.current, "A")
    scribe.write(begun.state())
    assert scribe.flush(60)
    assert said[0]
    assert said[1:] == [""]
    scribe.end("closed")
    scribe.stop()
    assert fingerprint(one(tmp_path).state) == fingerprint(begun.state())


def test_states_that_wait_are_passed_over_for_the_newest(tmp_path: Path) -> None:
    scribe = Scribe(tmp_path)
    for number, state in enumerate(islice(states(4), 100)):
        scribe.begin(state, safe=False) if number == 0 else scribe.write(state)
    scribe.end("closed")
    scribe.stop()
    found = one(tmp_path)
    assert found.why == "closed"
    assert fingerprint(found.state) == fingerprint(state)


def test_a_saved_document_that_is_closed_leaves_nothing(tmp_path: Path) -> None:
    scribe = Scribe(tmp_path)
    scribe.begin(history().state(), "x.obj")
    scribe.end()
    scribe.begin(history().state(), "y.obj")
    scribe.saved("y.eigenform", history().state())
    scribe.end()
    scribe.stop()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="folders are not made read-only there")
def test_a_failing_disk_is_said_once_and_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    full = threading.Event()
    real = journal_module.append_record

    def append(file: BinaryIO, kind: int, payload: bytes) -> None:
        if full.is_set():
            file.write(payload[: len(payload) // 2])
            raise OSError(28, "No space left on device")
        real(file, kind, payload)

    monkeypatch.setattr(journal_module, "append_record", append)
    monkeypatch.setattr(scribe_module, "RETRY_SECONDS", 0.0)
    begun = history()
    scribe = Scribe(tmp_path, said.append)
    scribe.begin(begun.state(), safe=False)
    scribe.flush()
    full.set()
    for _ in range(3):
        begun.add(begun.current, "A")
        scribe.write(begun.state())
        scribe.flush()
    assert len(said) == 1
    assert "disk is full" in said[0]
    full.clear()
    begun.add(begun.current, "B")
    scribe.write(begun.state())
    scribe.flush()
    assert said[1:] == [""]
    scribe.end("closed")
    scribe.stop()
    found = recover(tmp_path, KINDS)
    newest = found[0]
    assert fingerprint(newest.state) == fingerprint(begun.state())
    check_sound(found)


def test_a_step_that_cannot_be_written_does_not_end_the_journal(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scribe_module, "RETRY_SECONDS", 0.0)
    said: list[str] = []
    begun = history()
    scribe = Scribe(tmp_path, said.append)
    scribe.begin(begun.state(), safe=False)
    bad = UnknownStep("bad", {"a": object()})
    begun.add(begun.current.with_step(bad, begun.current.mesh), "Bad")
    scribe.write(begun.state())
    scribe.flush()
    begun.take_back()
    begun.add(begun.current, "Good")
    scribe.write(begun.state())
    scribe.end("closed")
    scribe.stop()
    assert "could not be written" in said[0]
    newest, *_rest = recover(tmp_path, KINDS)
    assert fingerprint(newest.state) == fingerprint(begun.state())
    newest.release()


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileError):
        Journal(tmp_path / "file" / "journals")
    with pytest.raises(EngineError):
        Journal(tmp_path / "file")


# ---- really killed


KILLS = [pytest.param(4), pytest.param(50, marks=pytest.mark.soak)]


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is of POSIX")
@pytest.mark.parametrize("module", ["scripted_session", "slow_disk_session"])
@pytest.mark.parametrize("kills", KILLS)
def test_killed_at_random_moments_at_most_one_stroke_is_lost(
    kills: int, module: str, tmp_path: Path
) -> None:
    dice = random.Random(kills)
    lost = []
    for seed in range(kills):
        folder = tmp_path / str(seed)
        number, age = killed_session(module, folder, seed, after=dice.uniform(0.0, 1.6))
        found = recover(folder, KINDS)
        near = range(max(0, number - 2), number + 5)
        expected = {
            k: fingerprint(state, times=False)
            for k, state in enumerate(islice(states(seed), near.stop))
            if k in near
        }
        if not found:
            # Nothing but the first state, which is in its file, had been handed over.
            assert number <= 1
            lost.append(0)
            continue
        (entry,) = found
        # Two neighbours may be the same (an undo with nothing to undo): the later one counts.
        mark = fingerprint(entry.state, times=False)
        reached = max((k for k, state in expected.items() if state == mark), default=-1)
        assert entry.report == ()
        assert reached >= number - 1
        lost.append(max(0, number - reached))
        if lost[-1]:
            print(f"a state was lost that was at most {1000 * age:.0f} ms old")
        entry.discard()
    print(f"{kills} kills: {sum(lost)} states lost in all, at most {max(lost)} at once")


def killed_session(module: str, folder: Path, seed: int, after: float) -> tuple[int, float]:
    """Run the scripted session and kill it.

    Returns the number of the last state handed over, and at most how old it was, in seconds.
    """
    # The last line may have been cut off by the kill.
    written = lines_until_killed(f"tests.engine.{module}", folder, seed, after)[:-1]
    number, handed = written[-1].split()
    return int(number), time.monotonic() - float(handed)
