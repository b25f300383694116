"""A real window, worked in by real events until it is killed: `killed_window STATE_FOLDER SEED`.

After every change of the document it writes a digest of the whole history, so that whoever killed
it can tell what should be restored.
"""

from __future__ import annotations

import hashlib
import random
import sys
from pathlib import Path

from PySide6.QtCore import QSettings

from app.look import Appearance
from app.start import application
from app.window import Window
from engine import Document, HistoryState, scribe
from tests.app.driving import bumpy_sphere
from tests.engine.histories import fingerprint
from tests.program import PATIENCE
from tests.soak.monkey import Monkey, pump


def digest(state: HistoryState) -> str:
    """What tells two histories apart, whatever the clock said."""
    return hashlib.sha256(fingerprint(state, times=False).encode()).hexdigest()


def main(folder: Path, seed: int) -> None:
    """Work without an end."""
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(folder / "s"))
    # However long this machine takes over a state: what a hand waits for is shown elsewhere.
    scribe.PATIENCE = PATIENCE
    window = Window(Appearance(application(), "dark"))
    window.keep_safe(folder)
    window.show()
    session = window.session
    session.start(Document.open(bumpy_sphere(900), "sphere.ply"))

    def note() -> None:
        assert session.history is not None
        sys.stdout.write(digest(session.history.state()) + "\n")
        sys.stdout.flush()

    note()
    session.document_changed.connect(note)
    monkey = Monkey(window, seed, folder, [])
    dice = random.Random(seed)
    acts = [monkey.likely_edit, monkey.slide, monkey.undo_or_redo, monkey.travel, monkey.rest]
    while True:
        dice.choices(acts, [6, 1, 2, 1, 1])[0]()
        pump(None, 10)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
