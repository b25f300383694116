"""Files: meshes and documents opened, meshes and recipes written, in the background."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import psutil
from PySide6.QtCore import QObject, Signal

import engine
from app.session import Session
from app.viewport.heavy import prepare
from engine import Document, Imported, Run
from engine.archive import DOCUMENT_SUFFIX, Archive, open_archive
from engine.files.place import write_file
from engine.files.report import shown
from plugins.registry import kinds

CHANNEL = "file"
HEAVY = 2**30  # bytes of memory: to open a file that takes more is worth a question


class Files(QObject):
    """Opens files into a session, and writes what is open; what is open stays until another is.

    Signals
    -------
    unpacked(archive) : what is open came from a document file, with what else was in it.
    imported(found, path) : a file was not taken as it stood; its report says what was done.
    heavy(path, bytes) : a file takes much memory to open, and nobody said that it shall.
    """

    unpacked = Signal(object)
    imported = Signal(object, object)
    heavy = Signal(object, object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session

    def open(self, path: Path, *, sure: bool = False) -> None:
        """Open a mesh or a document in the background; what is open stays until it is there.

        Parameters
        ----------
        sure : open also a file that takes much memory, without asking by `heavy`.
        """
        if path.suffix.lower() == DOCUMENT_SUFFIX:
            self._open_document(path)
            return

        def work(run: Run) -> Any:
            needed = 0 if sure else engine.estimate(path)
            if is_heavy(needed):
                return needed
            found = engine.open_file(path, run=run)
            prepare(found.mesh)
            return found

        def done(found: Any) -> None:
            if isinstance(found, int):
                self.heavy.emit(path, found)
            else:
                self.take(found, path)

        self._session.jobs.submit(CHANNEL, work, done, self._session.problems.report, priority=1)

    def take(self, found: Imported, path: Path) -> None:
        """Make what was read of a file the document, and tell what was done to it."""
        self._session.start(Document.open(found.mesh, path.name), path=path)
        if found.report.changed or found.report.warnings:
            self.imported.emit(found, path)

    def _open_document(self, path: Path) -> None:
        def done(archive: Archive) -> None:
            # What was lost of a damaged file may yet be wanted: it is not saved over.
            self._session.take_up(archive.history, None if archive.report else path, archive.stamp)
            self.unpacked.emit(archive)
            if archive.report:
                self._session.problems.say(" ".join(archive.report))

        def work(run: Run) -> Archive:
            archive = open_archive(path, kinds(), run)
            prepare(archive.history.current.mesh)
            return archive

        self._session.jobs.submit(CHANNEL, work, done, self._session.problems.report, priority=1)

    def export(self, path: Path) -> None:
        """Write the mesh as it is after the steps applied so far, in the background."""
        document = self._session.document
        if document is None:
            return
        mesh = document.mesh
        self._session.writing.write(
            path,
            lambda run: engine.save(mesh, path, run),
            lambda _none: self._session.noticed.emit(f"Exported to {shown(path.name)}"),
            self._session.problems.report,
        )

    def export_recipe(self, path: Path) -> None:
        """Write the steps applied so far as a recipe that replays without a window."""
        document = self._session.document
        if document is None:
            return
        recipe = document.recipe
        self._session.writing.write(
            path,
            lambda _run: write_file(path, recipe.to_json().encode("utf-8")),
            lambda _none: self._session.noticed.emit(f"Recipe saved to {shown(path.name)}"),
            self._session.problems.report,
            urgent=True,
        )


def is_heavy(needed: int) -> bool:
    """Whether opening a file of so many bytes of memory is worth a question."""
    return bool(needed > min(HEAVY, psutil.virtual_memory().available // 2))
