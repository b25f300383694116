"""Damaged files open right, by a second reader's opinion, or are refused in plain words."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.soak.mutations import Tally, run, seeds


def assert_no_faults(tally: Tally, count: int) -> None:
    assert tally.faults == []
    assert tally.opened.total() + tally.refused.total() == count
    # Each kind of file was damaged lightly enough to open, and badly enough to be refused.
    for name in seeds():
        assert tally.opened[name], name
        assert tally.refused[name], name


def test_hundreds_of_damaged_files(tmp_path: Path) -> None:
    assert_no_faults(run(900, seed=7, folder=tmp_path), 900)


@pytest.mark.soak
def test_ten_thousand_damaged_files(tmp_path: Path) -> None:
    assert_no_faults(run(10_000, seed=1, folder=tmp_path), 10_000)
