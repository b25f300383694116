"""A damaged journal: what can be had of it is had, and what is lost is said."""

from __future__ import annotations

import dataclasses
import random
from itertools import islice
from pathlib import Path

import pytest

from engine.journal import Journal, recover, same_state
from engine.records import HEAD, append_record, read_records
from tests.engine.histories import KINDS, fingerprint, history
from tests.engine.journals import abandoned, check_sound, one
from tests.engine.scripted_session import states

STRIDES = [pytest.param(97), pytest.param(1, marks=pytest.mark.soak)]


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


def test_what_was_open_and_is_lost_gives_way_to_the_newest_and_is_told(tmp_path: Path) -> None:
    state = history().state()
    journal = Journal(tmp_path)
    journal.write(state)
    open_and_lost = {"event": "state", "changed": [], "gone": [], "redo": {}, "time": 0.0}
    journal._append({**open_and_lost, "current": max(state.moments) + 1})
    journal._file.close()
    found = one(tmp_path)
    assert set(found.state.moments) == set(state.moments)
    assert found.state.current_id == max(state.moments)
    assert found.report == ("What was open is lost; the newest state that is left is shown.",)


def test_states_are_the_same_when_neither_holds_more() -> None:
    whole = history().state()
    less = dict(whole.moments)
    del less[next(i for i in sorted(less, reverse=True) if i != whole.current_id)]
    fewer = dataclasses.replace(whole, moments=less)
    assert same_state(whole, dataclasses.replace(whole, moments=dict(whole.moments)))
    assert not same_state(whole, fewer)
    assert not same_state(fewer, whole)


def test_records_across_the_blocks_of_a_search(tmp_path: Path) -> None:
    path = tmp_path / "records"
    for before in (2**20 - 3, 2**20, 2**20 + 1, 2**21 - 2):
        with path.open("wb", buffering=0) as file:
            file.write(bytes(before))
            append_record(file, 1, b"here")
        assert list(read_records(path))[-1] == (1, b"here")
        assert path.stat().st_size == before + HEAD + 4
