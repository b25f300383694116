"""Document files in the window: save, save as, and a camera that is found again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from app.files import Files
from app.places import folder_of
from app.session import Session
from app.viewport import Viewport
from app.viewport.camera import Eye
from engine import EngineError, HistoryState
from engine.archive import DOCUMENT_SUFFIX, Archive, save_archive
from engine.files.place import Stamp
from engine.files.report import shown
from engine.plain import from_plain, to_plain

FILTER = f"Eigenform document (*{DOCUMENT_SUFFIX})"


class Documents(QObject):
    """Saves what is open as a document file, in the background.

    Parameters
    ----------
    session : what is open.
    files : says when a document was opened.
    viewport : its camera is saved and found again.
    window : parent of the file dialog.

    Signals
    -------
    saved(path, state) : all of `state` is safe in the file.
    """

    saved = Signal(object, object)

    def __init__(self, session: Session, files: Files, viewport: Viewport, window: QWidget) -> None:
        super().__init__(window)
        self._session = session
        self._viewport = viewport
        self._window = window
        self.pictures: Callable[[], Mapping[int, bytes]] = dict
        files.unpacked.connect(self._unpacked)

    @property
    def path(self) -> Path | None:
        """The document file that is open, or None when it is a mesh or was never saved."""
        path = self._session.path
        return path if path is not None and path.suffix.lower() == DOCUMENT_SUFFIX else None

    def save(self, then: Callable[[], object] | None = None) -> None:
        """Save to the file that is open, or ask for one; `then` follows when all is safe."""
        path = self.path
        if path is not None:
            self.save_to(path, then, self._session.stamp)
        else:
            self.save_as(then)

    def save_as(self, then: Callable[[], object] | None = None) -> None:
        """Ask for a file and save to it."""
        path = self.ask_path()
        if path is not None:
            self.save_to(path, then)

    def save_copy(self) -> None:
        """Ask for a file and save to it at once; what is open goes on under its own name.

        This is for when something has failed: it waits for no other thread.
        """
        path, history = self.ask_path(), self._session.history
        if path is None or history is None:
            return
        try:
            save_archive(path, history.state(), dict(self.pictures()), self.window_state())
        except EngineError as error:
            self._session.problems.report(error)
            return
        self._session.noticed.emit(f"Saved to {shown(path.name)}")

    def ask_path(self) -> Path | None:
        """Let the person choose where the document goes."""
        document, path = self._session.document, self._session.path
        if document is None:
            return None
        folder = folder_of(path) if path is not None else Path.home()
        suggested = folder / (Path(document.name or "untitled").stem + DOCUMENT_SUFFIX)
        name, _ = QFileDialog.getSaveFileName(self._window, "Save document", str(suggested), FILTER)
        if not name:
            return None
        chosen = Path(name)
        if chosen.suffix.lower() == DOCUMENT_SUFFIX:
            return chosen
        return chosen.with_name(chosen.name + DOCUMENT_SUFFIX)

    def save_to(
        self, path: Path, then: Callable[[], object] | None = None, known: Stamp | None = None
    ) -> None:
        """Save as `path` in the background; a failure is shown and nothing follows.

        With the stamp `known`, the file is replaced only if nobody else has changed it since.
        """
        history = self._session.history
        if history is None:
            return
        state: HistoryState = history.state()
        pictures, window = dict(self.pictures()), self.window_state()

        def done(stamp: Stamp | None) -> None:
            if self._session.history is history:
                self._session.path = path
                self._session.stamp = stamp
                self.saved.emit(path, state)
            self._session.noticed.emit(f"Saved to {shown(path.name)}")
            if then is not None:
                then()

        self._session.writing.write(
            path,
            lambda _run: save_archive(path, state, pictures, window, known),
            done,
            self._session.problems.report,
            # It may go between two ticks of a long computation: it shares nothing with it.
            urgent=True,
        )
        self._session.busy_changed.emit()

    def window_state(self) -> dict[str, Any]:
        """What the window wants to find again with this document."""
        return {"eye": to_plain(self._viewport.eye, _no_arrays)}

    def _unpacked(self, archive: Archive) -> None:
        try:
            eye = from_plain(Eye, archive.window.get("eye"), _no_fetch)
        except EngineError:
            return  # written by another version, or damaged: the usual view does
        sound = eye.centre.shape == (3,) and np.isfinite(eye.centre).all() and eye.up in (1, 2)
        if sound and eye.distance > 0:
            self._viewport.look(eye, animate=False)


def _no_arrays(_array: Any) -> str:
    raise AssertionError("the camera holds no long array")


def _no_fetch(key: str) -> Any:
    raise EngineError(f"The camera refers to an array {key}, which it cannot.")
