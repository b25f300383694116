"""Decomposing: the base and the modes of regions, as far as they are known."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator

from PySide6.QtCore import QObject, Signal

import engine
from app.jobs import Jobs
from engine import Decomposition, Document, Mesh, Run
from engine.arrays import I64

CHANNEL = "decompose"
KEPT = 6

Key = tuple[int, int, str, bool]


class Decomposing(QObject):
    """Decomposes regions in the background and keeps what is known of the last few.

    Signals
    -------
    grew(first) : more is known of the region asked for; `first` when nothing was known before.
    failed(document, error) : the region of `document` cannot be taken apart any further.
    """

    grew = Signal(bool)
    failed = Signal(object, object)

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._known: OrderedDict[Key, tuple[Decomposition, Mesh, I64]] = OrderedDict()
        self._asked: Key | None = None

    def of(self, document: Document) -> Decomposition | None:
        """What is known about the region of a document so far."""
        kept = self._known.get(_key(document)) if document.draft.roi is not None else None
        return None if kept is None else kept[0]

    def reaching(self, document: Document) -> Decomposition | None:
        """What is known already, if it is enough for the level: the same numbers, sooner."""
        known = self.of(document)
        return known if known is not None and known.reaches(document.draft.level) else None

    def ask(self, document: Document) -> None:
        """Find out more about the region of `document`; that of any other is left as it is."""
        roi, options = document.draft.roi, document.draft.options
        if roi is None:
            self._jobs.cancel(CHANNEL)
            self.forget_asked()
            return
        known, key = self.of(document), _key(document)
        if key == self._asked or (known is not None and known.complete):
            return
        self._asked = key
        mesh = document.mesh

        def work(run: Run) -> Iterator[Decomposition]:
            yield from engine.decompose_stream(
                mesh, roi, rim=options.rim, run=run, free_borders=options.free_borders
            )

        def done(decomposition: Decomposition) -> None:
            first = key not in self._known
            self._known[key] = (decomposition, mesh, roi)
            self._known.move_to_end(key)
            while len(self._known) > KEPT:
                self._known.popitem(last=False)
            self.grew.emit(first)

        def failed(error: Exception) -> None:
            self.forget_asked()
            self.failed.emit(document, error)

        self._jobs.submit(CHANNEL, work, done, failed, priority=5)

    def forget_asked(self) -> None:
        """Nothing is under way any more; the same region may be asked for again."""
        self._asked = None

    def clear(self) -> None:
        """Stop, and forget everything."""
        self._jobs.cancel(CHANNEL)
        self._known.clear()
        self.forget_asked()


def _key(document: Document) -> Key:
    """Identity of what a decomposition depends on; the kept entry holds the objects alive."""
    options = document.draft.options
    return (id(document.mesh), id(document.draft.roi), options.rim, options.free_borders)
