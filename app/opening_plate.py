"""Opening plate: what a person is told and asked when a file is opened."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import psutil
from PySide6.QtCore import QObject

from app.files import Files
from app.plate import Plate
from app.seeing import UNIT_WORDS, likely_unit, size_words, unit_question
from app.session import Session
from app.viewport import Viewport
from engine import Imported
from engine.arrays import F64
from engine.files.report import shown

SAMPLE = 5000  # vertices tell where the form is


class OpeningPlate(QObject):
    """Shows on a plate what was done to a file, whether it is large, and what its unit may be."""

    def __init__(self, session: Session, files: Files, plate: Plate) -> None:
        super().__init__(plate)
        self._session = session
        self._files = files
        self._plate = plate
        session.opened.connect(self._opened)
        files.imported.connect(self._show_report)
        files.heavy.connect(self._ask_heavy)

    def _opened(self) -> None:
        self._plate.hide()
        self._ask_unit()

    def _ask_unit(self) -> None:
        """Ask what one unit is when the model would be oddly small or large."""
        document = self._session.document
        if document is not None and likely_unit(document) is not None:
            self._plate.say(
                f"Opened {shown(document.name)}", [unit_question(document)], self._unit_buttons()
            )

    def _ask_heavy(self, path: Path, needed: int) -> None:
        """Ask before a file is opened that takes much memory."""
        free = psutil.virtual_memory().available
        words = (
            f"It needs about {needed / 2**30:.1f} GiB of memory; {free / 2**30:.1f} GiB are free."
        )
        self._plate.say(
            f"Open {shown(path.name)}?",
            [words],
            {
                "Open": lambda: self._files.open(path, sure=True),
                "Leave it": lambda: None,
            },
        )

    def _show_report(self, found: Imported, path: Path) -> None:
        """Say what was done to a file, and offer to take it as it is."""
        report = found.report
        buttons: dict[str, Callable[[], object]] = {}
        if report.repairs:
            declined = found.without_repairs
            buttons["Open without repairs"] = lambda: self._files.take(declined, path)
        document = self._session.document
        doubtful = document is not None and likely_unit(document) is not None
        size = [] if document is None else [size_words(document)]
        question = [unit_question(document)] if document is not None and doubtful else size
        buttons |= self._unit_buttons() if doubtful else {"Good": lambda: None}
        self._plate.say(f"Opened {report.name}", [*report.lines(), *question], buttons)

    def _unit_buttons(self) -> dict[str, Callable[[], object]]:
        return {
            words.capitalize(): partial(self._session.set_unit, unit)
            for unit, words in UNIT_WORDS.items()
        }


def form_seen(session: Session, viewport: Viewport) -> F64:
    """Return where a sample of the form's vertices is seen, (p, 2) px."""
    document = session.document
    if document is None:
        return np.zeros((0, 2))
    vertices = document.mesh.vertices
    return viewport.view().project(vertices[:: max(1, len(vertices) // SAMPLE)])
