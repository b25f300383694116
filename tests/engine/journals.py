"""Journals as a killed program leaves them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from engine import HistoryState
from engine.journal import Journal, Recoverable, recover
from tests.engine.histories import KINDS


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


def check_sound(found: list[Recoverable]) -> None:
    """Check that what was found can be worked with, and let go of its journals."""
    for entry in found:
        for moment in entry.state.moments.values():
            assert np.isfinite(moment.document.mesh.vertices).all()
            assert moment.document.mesh.faces.max() < moment.document.mesh.n
        entry.release()
