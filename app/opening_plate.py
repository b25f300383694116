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
from app.session import Session
from app.sizes import UNIT_WORDS, likely_unit, size_words, unit_question
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
        self._found: tuple[Imported, Path] | None = None
        self._telling = False
        session.opened.connect(self._opened)
        session.document_changed.connect(self._make_room)
        files.imported.connect(self._show_report)
        files.heavy.connect(self._ask_heavy)

    def tell(self) -> None:
        """Say again what is known of the file, and ask what its unit is."""
        self._tell(asking=True)

    def _tell(self, asking: bool = False) -> None:
        """Say what is known of the file; ask for its unit if that is wanted or the size is odd."""
        document = self._session.document
        if document is None:
            return
        lines: list[str] = []
        buttons: dict[str, Callable[[], object]] = {}
        if self._found is not None:
            found, path = self._found
            # The name of the file stands above already.
            lines = [line.removeprefix(f"{found.report.name}: ") for line in found.report.lines()]
            if found.report.repairs:
                declined = found.without_repairs
                buttons["Open without repairs"] = lambda: self._files.take(declined, path)
        if likely_unit(document) is not None:
            lines.append(unit_question(document))
            buttons |= self._unit_buttons()
        elif asking:
            lines.append(f"{size_words(document)} What is one unit of it?")
            buttons |= self._unit_buttons()
        else:
            lines.append(size_words(document))
            buttons["Good"] = lambda: None
        self._plate.say(f"Opened {shown(document.name)}", lines, buttons)
        self._telling = True

    def _opened(self) -> None:
        self._plate.hide()
        self._found, self._telling = None, False
        document = self._session.document
        if document is not None and likely_unit(document) is not None:
            self._tell()

    def _make_room(self) -> None:
        """Leave the form to a person who has begun; the status bar brings the plate back."""
        document = self._session.document
        if self._telling and document is not None and document.draft.roi is not None:
            self._telling = False
            self._plate.hide()

    def _ask_heavy(self, path: Path, needed: int) -> None:
        """Ask before a file is opened that takes much memory."""
        self._telling = False
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
        self._found = found, path
        self._tell()

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
