"""Start level: where the slider of a new region begins, which is not always at its base."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject

from app.session import Session
from engine import Decomposition
from engine.arrays import I64
from engine.level import off_form

FAR = 0.08  # of the size of the form: a base so far off has none of its features left
NEAR = 0.04  # so near to the form its parts can be found again
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)  # numbers of modes looked at
RAISED = (
    "The base of this region is a thin shape far from the form, so the level begins above it; "
    "{level.base} shows the base"
)


class StartLevel(QObject):
    """Raises the level of a region just chosen when its base is far from the form.

    The end of a grip or a mouth has a rim on one side only: stretched over that, its base is a lid
    or a thin waist on which nobody finds a place to draw. A few modes bring the form back.

    Parameters
    ----------
    session : what is worked on.
    drawing : tells whether a gesture is under way; then nothing moves below the hand.
    """

    def __init__(
        self, session: Session, drawing: Callable[[], bool], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._drawing = drawing
        self._settled: I64 | None = None  # the region that has been seen to
        self._roi: I64 | None = None  # the one that is looked at
        self._looked = 0  # modes of it
        session.decomposition_changed.connect(self._look)

    def _look(self) -> None:
        document, known = self._session.document, self._session.decomposition
        if document is None or known is None or document.draft.roi is self._settled:
            return
        if not self._fresh() or self._drawing():
            self._settled = document.draft.roi
            return
        if document.draft.roi is not self._roi:
            self._roi, self._looked = document.draft.roi, 0
            if _off(known, 0) < FAR:
                self._settled = self._roi
                return
        for count in COUNTS:
            if self._looked < count <= known.k and _off(known, count) < NEAR:
                self._settled = self._roi
                self._session.begin_at(known.level_of(count))
                self._session.told.emit(RAISED)
                return
        self._looked = known.k
        if known.k >= COUNTS[-1]:
            self._settled = self._roi

    def _fresh(self) -> bool:
        """Whether the region was chosen just now and nothing was done with it."""
        session = self._session
        document, moment = session.document, session.moment
        if document is None or moment is None or moment.parent is None or session.history is None:
            return False
        draft, before = document.draft, session.history.moments[moment.parent].document.draft
        untouched = draft.source is None and not draft.strokes and draft.level == 0.0
        return untouched and draft.roi is not before.roi


def _off(known: Decomposition, count: int) -> float:
    return off_form(known.surface(count), known.original, known.areas)
