"""The scribe: disks that hang, fail and fill up hold nobody up and are said once."""

from __future__ import annotations

import sys
import threading
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from engine import Document, EngineError, FileError, History, HistoryState, UnknownStep
from engine import journal as journal_module
from engine import pusher as pusher_module
from engine import scribe as scribe_module
from engine.journal import Journal, recover
from engine.scribe import Scribe
from tests.engine.histories import KINDS, fingerprint, grid, history
from tests.engine.journals import check_sound, one
from tests.engine.scripted_session import states


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


def test_a_state_is_handed_over_once_the_one_before_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scribe_module, "PATIENCE", 60.0)
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
