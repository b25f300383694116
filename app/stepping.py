"""Stepping: steps computed in the background, to apply or only to look at.

A step may be a stranger's: one that raises, hangs or gives nonsense is given up and named.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

import engine
from app.jobs import Jobs
from app.viewport.heavy import prepare
from engine import Document, Mesh, Run, SketchEdit, Step, StepError

HUNG = 10.0  # seconds without a sign after which a step that does not stop is to blame


class Stepping(QObject):
    """Computes steps one at a time; a newer preview takes the place of the one before.

    Signals
    -------
    applied(document, step, mesh) : what `step` makes of `document`, to keep.
    previewed(document, mesh) : what a step would make of it, to look at.
    failed(error) : a step was not done; nothing was changed by it.
    misbehaved(step, reason, wrong) : a step raised, hung or gave nonsense and was given up; when
        not `wrong` it may only have been slow.
    gave_up : after either of these, when what is shown is to be what it was.
    """

    applied = Signal(object, object, object)
    previewed = Signal(object, object)
    failed = Signal(object)
    misbehaved = Signal(object, str, bool)
    gave_up = Signal()

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs

    @property
    def applying(self) -> bool:
        """Whether a step is being computed that will change the document."""
        return self._jobs.busy("apply")

    def apply(self, step: Step, document: Document) -> None:
        """Compute `step` on a document, to keep; what was only looked at is of no use any more."""

        def failed(error: Exception) -> None:
            self._refuse(error)
            self.gave_up.emit()

        self._jobs.cancel("solve")
        self._compute(
            "apply",
            step,
            document,
            lambda mesh: self.applied.emit(document, step, mesh),
            failed,
            priority=1,
        )

    def preview(self, step: Step, document: Document) -> None:
        """Compute `step` on a document, to look at."""
        self._compute(
            "solve",
            step,
            document,
            lambda mesh: self.previewed.emit(document, mesh),
            self._refuse,
            priority=0,
            overtakable=True,
        )

    def _compute(
        self,
        channel: str,
        step: Step,
        document: Document,
        done: Callable[[Any], None],
        failed: Callable[[Exception], None],
        *,
        priority: int,
        overtakable: bool = False,
    ) -> None:
        # Our own edit may take its time on a large mesh.
        ours = isinstance(step, SketchEdit)
        self._jobs.submit(
            channel,
            lambda run: _computed(step, document.mesh, run),
            done,
            failed,
            priority=priority,
            overtakable=overtakable,
            stuck=None if ours else lambda silent: self._leave_behind(step, silent),
        )

    def _refuse(self, error: Exception) -> None:
        """Say why a step was not done; one that misbehaved is the business of its tool."""
        if isinstance(error, StepError):
            self.misbehaved.emit(error.step, error.reason, True)
        else:
            self.failed.emit(error)

    def _leave_behind(self, step: Step, silent: float) -> None:
        """A step did not come back: go on without it."""
        # The same step may wait to be applied after its preview.
        self._jobs.cancel("apply")
        if silent > HUNG:
            self.misbehaved.emit(step, f"gave no sign of life for {silent:.0f} seconds", True)
        else:
            self.misbehaved.emit(step, "did not stop when it was told to", False)
        self.gave_up.emit()


def _computed(step: Step, mesh: Mesh, run: Run) -> Mesh:
    """Return what a step makes of a mesh, ready to be shown."""
    result = engine.applied(step, mesh, run)
    if result.faces is not mesh.faces:
        prepare(result)
    return result
