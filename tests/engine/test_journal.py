"""The journal: what a kill leaves is offered; at any moment at most the last stroke is gone."""

from __future__ import annotations

import os
import random
import sys
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from engine import Document, History
from engine import journal as journal_module
from engine.journal import Journal, Why, recover
from tests.engine.histories import KINDS, fingerprint, grid, history
from tests.engine.journals import abandoned, one
from tests.engine.scripted_session import states
from tests.killing import lines_until_killed


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
