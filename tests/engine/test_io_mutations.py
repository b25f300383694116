"""Damaged files open right, by a second reader's opinion, or are refused in plain words."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.soak.mutations import Tally, run


def assert_no_faults(tally: Tally, count: int) -> None:
    assert tally.faults == []
    assert tally.opened.total() + tally.refused.total() == count
    # Each kind of file was damaged lightly enough to open, and badly enough to be refused.
    for name in tally.names:
        assert tally.opened[name], name
        assert tally.refused[name], name


def test_hundreds_of_damaged_files(tmp_path: Path) -> None:
    assert_no_faults(run(900, seed=7, folder=tmp_path), 900)


def test_damage_in_formats_that_native_code_reads(tmp_path: Path) -> None:
    assert_no_faults(run(64, seed=3, folder=tmp_path, experimental=True), 64)


@pytest.mark.soak
def test_a_thousand_damaged_files_that_native_code_reads(tmp_path: Path) -> None:
    assert_no_faults(run(1000, seed=4, folder=tmp_path, experimental=True), 1000)


@pytest.mark.soak
def test_ten_thousand_damaged_files(tmp_path: Path) -> None:
    assert_no_faults(run(10_000, seed=1, folder=tmp_path), 10_000)
