"""Autosave: hands every state of the document to the scribe, and knows what is unsaved."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import numpy as np
from PySide6.QtCore import QObject, Qt, Signal, SignalInstance

from engine import History, HistoryState, Moment
from engine.files.place import Stamp
from engine.files.report import shown
from engine.journal import Recoverable, Why, same_state
from engine.scribe import Scribe

log = logging.getLogger(__name__)

JOURNALS = "journals"


class Journalled(Protocol):
    """What is needed of the session."""

    opened: SignalInstance
    document_changed: SignalInstance
    history: History | None
    path: Path | None
    stamp: Stamp | None

    def take_up(
        self, history: History, path: Path | None = None, stamp: Stamp | None = None
    ) -> None: ...


class Autosave(QObject):
    """Keeps the journal of whatever is open.

    Parameters
    ----------
    session : its `opened` and `document_changed` say when there is something new.
    folder : the state folder; journals go into a folder in it.

    Signals
    -------
    problem(sentence) : the journal cannot be written; "" when it can be again.
    unsaved_changed : `unsaved` may be another.
    set_aside(name) : another document was opened over unsaved work, which is kept.
    """

    problem = Signal(str)
    unsaved_changed = Signal()
    set_aside = Signal(str)

    def __init__(self, session: Journalled, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.folder = folder / JOURNALS
        self._scribe = Scribe(self.folder, self.problem.emit)
        self._safe: HistoryState | None = None
        self._latest: HistoryState | None = None
        self._restoring: Recoverable | None = None
        self._ended = False
        direct = Qt.ConnectionType.DirectConnection
        session.opened.connect(self._opened, direct)
        session.document_changed.connect(self._changed, direct)

    @property
    def unsaved(self) -> bool:
        """Whether the document differs from its file in any way, a region or a level included."""
        state = self._latest
        return state is not None and (self._safe is None or not same_state(state, self._safe))

    @property
    def worth_asking(self) -> bool:
        """Whether work would be missed: a step, a named region, view or variant, not a draft."""
        state, safe = self._latest, self._safe
        if state is None:
            return False
        known = {} if safe is None else safe.moments
        return any(
            known.get(i) is not moment and _is_work(moment, state.moments)
            for i, moment in state.moments.items()
        )

    def saved(self, path: Path, state: HistoryState) -> None:
        """Note that `state` is safe in the document file `path`."""
        self._safe = state
        stamp = self._session.stamp if self._session.path == path else None
        self._scribe.saved(str(path), state, stamp)
        self.unsaved_changed.emit()

    def restore(self, found: Recoverable) -> None:
        """Open what a journal holds; that journal goes once the new one has it all."""
        self._restoring = found
        path = Path(found.saved_to) if found.saved_to else None
        self._session.take_up(History.from_state(found.state), path, found.stamp)

    def end(self, keep: Why | None = None) -> None:
        """End the journal for good: without `keep` nothing of it stays."""
        if not self._ended:
            self._ended = True
            self._scribe.end(keep)
            self._scribe.stop()

    def flush(self, seconds: float = 10.0) -> bool:
        """Wait until all is written; for a crash and for tests."""
        return self._scribe.flush(seconds)

    def _opened(self) -> None:
        history = self._session.history
        if history is None or self._ended:
            return
        if self._latest is not None:
            aside = self.worth_asking
            self._scribe.end("set aside" if aside else None)
            if aside:
                self.set_aside.emit(shown(self._latest.current.name))
        state = history.state()
        found, self._restoring = self._restoring, None
        self._latest = state
        self._safe = None if found is not None else state
        path = self._session.path
        file = "" if path is None else str(path)
        then = None if found is None else found.discard
        self._scribe.begin(state, file, self._session.stamp, safe=found is None, then=then)
        self.unsaved_changed.emit()

    def _changed(self) -> None:
        history = self._session.history
        if history is None or self._latest is None or self._ended:
            return
        self._latest = history.state()
        self._scribe.write(self._latest)
        self.unsaved_changed.emit()


def _is_work(moment: Moment, moments: Mapping[int, Moment]) -> bool:
    """Whether a moment holds more than a draft that its parent does not hold."""
    if moment.parent is None or moment.name:
        return bool(moment.name)
    before, now = moments[moment.parent].document, moment.document
    return (
        now.recipe is not before.recipe
        or now.unit != before.unit
        or dict(now.views) != dict(before.views)
        or now.regions.keys() != before.regions.keys()
        or not all(np.array_equal(ids, before.regions[name]) for name, ids in now.regions.items())
    )
