"""Damaged and hostile documents: what comes back is what was saved, or sound, or refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.soak.archive_mutations import run


@pytest.mark.parametrize(
    ("count", "seed"),
    [(150, 3), pytest.param(10_000, 1, marks=[pytest.mark.soak, pytest.mark.timeout(7200)])],
)
def test_damaged_and_hostile_documents(count: int, seed: int, tmp_path: Path) -> None:
    tally = run(count, seed, tmp_path)
    assert tally.faults == []
    assert tally.outcomes.total() == count
    # Damage was light enough to open, and bad enough to be refused, in both ways.
    for way in ("accident", "intent"):
        for outcome in ("opened whole", "saved in part and said so", "refused in words"):
            assert tally.outcomes[f"{way}: {outcome}"], (way, outcome)
