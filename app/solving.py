"""Solving: the edit that is drawn, prepared while the hand rests and solved while it moves."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from app.decomposing import Decomposing
from app.jobs import Jobs
from engine import (
    Document,
    EditOptions,
    EditResult,
    LevelResult,
    Mesh,
    Run,
    SketchEdit,
    Source,
)
from engine.arrays import I64

REST_MS = 150  # a level that stays this long is worth a factorisation
MOST_AHEAD = 100_000  # vertices of a region; a larger one takes much memory: not before it is asked

Prepared = tuple[Mesh, I64, float, EditOptions, Source | None]


class Solving(QObject):
    """Solves the strokes of a draft at its level, in the background.

    Signals
    -------
    solved : there is another result.
    failed(error) : the edit cannot be prepared or solved.
    """

    solved = Signal()
    failed = Signal(object)

    def __init__(self, jobs: Jobs, decomposing: Decomposing, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._decomposing = decomposing
        self._wanted: Mesh | None = None
        self._solved: tuple[Mesh, SketchEdit, LevelResult] | None = None
        self._resting_on: Document | None = None
        self._prepared: Prepared | None = None
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(REST_MS)
        self._rest.timeout.connect(self._rested)

    def result_on(self, mesh: Mesh) -> LevelResult | None:
        """The newest result, if it is one of this mesh."""
        return self._solved[2] if self._solved is not None and self._solved[0] is mesh else None

    def ask(self, document: Document, moving: bool = False) -> None:
        """Solve the edit of a document, unless that is what was solved last.

        Parameters
        ----------
        moving : a hand is still at it: what follows it soon is better than what is exact.
        """
        edit, mesh = document.draft.edit(), document.mesh
        if edit is None:
            self._jobs.cancel("solve")
            self._wanted = self._solved = None
            return
        self._wanted = mesh
        before = self._solved
        if before is not None and _same(before[:2], (mesh, edit)):
            enough = moving or isinstance(before[2], EditResult)
            if enough:
                return
        known = self._decomposing.reaching(document)

        def solved(run: Run) -> LevelResult:
            prepared = edit.prepare(mesh, run, known)
            return (prepared.follow if moving else prepared.solve)(edit.strokes)

        def done(result: LevelResult) -> None:
            if self._wanted is mesh:
                self._solved = (mesh, edit, result)
                self.solved.emit()

        self._jobs.submit(
            "solve",
            solved,
            done,
            self.failed.emit,
            priority=0,
            urgent=known is not None,
            overtakable=True,
        )

    def prepare_soon(self, document: Document) -> None:
        """Factorise at once for a source that was drawn, else when the level has come to rest."""
        self._rest.stop()
        self._resting_on = document
        if document.draft.roi is None or document.draft.acting:
            self._resting_on = None
        elif document.draft.source is not None:
            self._rested()
        else:
            self._rest.start()

    def clear(self) -> None:
        """Stop, and forget everything."""
        self.stop()
        for channel in ("prepare", "solve"):
            self._jobs.cancel(channel)
        self._wanted = self._solved = self._prepared = None

    def stop(self) -> None:
        """Wait for no level to come to rest any more."""
        self._rest.stop()
        self._resting_on = None

    def _rested(self) -> None:
        """Factorise for the level and the source that waits, before the target is drawn."""
        document, self._resting_on = self._resting_on, None
        if document is None:
            return
        draft, mesh = document.draft, document.mesh
        if draft.roi is None or (draft.source is None and len(draft.roi) > MOST_AHEAD):
            return
        known = self._decomposing.reaching(document)
        wanted = (mesh, draft.roi, draft.level, draft.options, draft.source)
        if known is None or (self._prepared is not None and _same_parts(wanted, self._prepared)):
            return
        self._prepared = wanted
        waiting = () if draft.source is None else (draft.source.still(mesh),)
        edit = SketchEdit(draft.roi, draft.level, (*draft.acting, *waiting), draft.options)
        self._jobs.submit(
            "prepare",
            lambda run: edit.prepare(mesh, run, known),
            lambda _prepared: None,
            self.failed.emit,
            priority=2,
            urgent=True,
        )


def _same_parts(one: Prepared, other: Prepared) -> bool:
    """Whether two preparations are of the same things; arrays are told apart by identity."""
    same = one[0] is other[0] and one[1] is other[1] and one[4] is other[4]
    return same and one[2:4] == other[2:4]


def _same(one: tuple[Mesh, SketchEdit], other: tuple[Mesh, SketchEdit]) -> bool:
    (mesh, before), (other_mesh, edit) = one, other
    return (
        mesh is other_mesh
        and before.roi is edit.roi
        and before.level == edit.level
        and before.options == edit.options
        and len(before.strokes) == len(edit.strokes)
        and all(a is b for a, b in zip(before.strokes, edit.strokes, strict=True))
    )
