"""A window that is really killed loses at most the stroke that was being drawn."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

from engine.journal import recover
from plugins.registry import kinds
from tests.killing import lines_until_killed
from tests.soak.killed_window import digest

KILLS = [
    pytest.param(2),
    pytest.param(50, marks=[pytest.mark.soak, pytest.mark.timeout(3600)]),
]


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is of POSIX")
@pytest.mark.parametrize("kills", KILLS)
def test_a_killed_window_loses_at_most_one_stroke(kills: int, tmp_path: Path, qapp) -> None:
    dice = random.Random(kills)
    lost = []
    for seed in range(kills):
        folder = tmp_path / str(seed)
        folder.mkdir()
        noted = killed(folder, seed, after=dice.uniform(0.0, 4.0))
        found = recover(folder / "journals", kinds())
        if not found:
            assert len(noted) <= 2, "only what was just opened needs no journal"
            lost.append(0)
            continue
        (entry,) = found
        assert entry.report == ()
        mark = digest(entry.state)
        # A state may be written before it is noted; then nothing of what was noted is missing.
        missing = noted[::-1].index(mark) if mark in noted else 0
        newer = mark not in noted
        assert missing <= 1
        assert not newer or len(entry.state.moments) > 1
        lost.append(missing)
        entry.discard()
    print(f"{kills} windows killed: {sum(lost)} strokes lost in all, at most {max(lost)} at once")


def killed(folder: Path, seed: int, after: float) -> list[str]:
    """Run a window, kill it some seconds after its document opened; return what it noted."""
    written = lines_until_killed("tests.soak.killed_window", folder, seed, after)
    # The last line may have been cut off by the kill; opening notes the same state more than once.
    whole = [line for line in written if len(line) == 64]
    return [line for line, before in zip(whole, ["", *whole], strict=False) if line != before]
