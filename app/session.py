"""The one mutable cell: which document is current, and every way to another one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.drafting import on_both_sides, one_step_back, resized
from app.form import Form
from app.jobs import Jobs
from app.problems import Problems
from app.showing import Showing
from app.stepping import Stepping
from app.turn import Turn
from app.writing import Writing
from engine import (
    Decomposition,
    Document,
    EditOptions,
    History,
    Mesh,
    Moment,
    Step,
)
from engine.arrays import I64, frozen
from engine.files.place import Stamp
from engine.view import View


class Session(QObject):
    """Owns the history; the engine's work for it is done by its parts.

    Attributes
    ----------
    jobs : the engine's thread.
    writing : the files that are being written.
    history : every document there was, or None before the first file.
    path : the file that is open, if it is one.
    stamp : what tells whether somebody else has changed this file since; None if not known.
    problems : the sentence that is shown about what went wrong.
    turn : the change under way; what shows the document asks it to be called once at its end.

    Signals
    -------
    opened : another mesh is open; its history has begun.
    document_changed : `document` is another one than before.
    shown_changed(flowing) : `form` is another; `flowing` when it should be seen to move there.
    decomposition_changed : more is known about the region (base, then more and more modes).
    misbehaved(step, reason, wrong) : a step was given up, see `Stepping`.
    noticed(text) : something worth a line was done (opened, exported).
    told(text) : something is worth knowing; nothing was asked for.
    applied : a step was added.
    progressed(channel, fraction, text) : work in a channel reports.
    busy_changed : work began or ended in some channel.
    """

    opened = Signal()
    document_changed = Signal()
    shown_changed = Signal(bool)
    decomposition_changed = Signal()
    misbehaved = Signal(object, str, bool)
    noticed = Signal(str)
    told = Signal(str)
    applied = Signal()
    progressed = Signal(str, float, str)
    busy_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.history: History | None = None
        self.path: Path | None = None
        self.stamp: Stamp | None = None
        self.problems = Problems(self)
        self.turn = Turn()
        self._coalescing: tuple[int, str] | None = None
        self.jobs = Jobs(self)
        self.writing = Writing(self.jobs, self)
        self._showing = Showing(self.jobs, self)
        self._stepping = Stepping(self.jobs, self)
        for changed in (self.jobs.began, self.jobs.idled):
            changed.connect(lambda _channel: self.busy_changed.emit())
        self.jobs.progressed.connect(self.progressed)
        self._showing.changed.connect(self.shown_changed)
        self._showing.decomposition_changed.connect(self.decomposition_changed)
        self._showing.region_failed.connect(self._region_failed)
        self._showing.failed.connect(self.problems.report)
        self._stepping.applied.connect(self._take_step)
        self._stepping.previewed.connect(self._look_at_step)
        self._stepping.misbehaved.connect(self.misbehaved)
        self._stepping.failed.connect(self.problems.report)
        self._stepping.gave_up.connect(self._step_given_up)

    # ---- what is open

    @property
    def document(self) -> Document | None:
        """The document as it is now, or None before the first file."""
        return None if self.history is None else self.history.current

    @property
    def moment(self) -> Moment | None:
        """The current place in the history."""
        return None if self.history is None else self.history.moments[self.history.current_id]

    @property
    def rests_on_details(self) -> bool:
        """Whether the step just applied is looked at: its details stay until the next action."""
        moment = self.moment
        if moment is None or moment.parent is None or self.history is None:
            return False
        before = self.history.moments[moment.parent].document
        draft = moment.document.draft
        fresh = draft.source is None and not draft.acting
        return fresh and moment.document.recipe is not before.recipe

    # ---- what is known and shown of it

    @property
    def subject(self) -> Document | None:
        """The document that is shown: the one that a gesture previews, or the current one."""
        return self._showing.subject

    @property
    def form(self) -> Form | None:
        """The surface as it is displayed: at the level, deformed, or the mesh itself."""
        return self._showing.form

    @property
    def shown(self) -> Mesh | None:
        """That surface as a mesh."""
        return None if self.form is None else self.form.whole

    @property
    def decomposition(self) -> Decomposition | None:
        """What is known about the current region so far."""
        return self._showing.decomposition

    @property
    def target_error(self) -> float | None:
        """How far the farthest anchor is from its target, px; None without a solved stroke."""
        return self._showing.target_error

    @property
    def applying(self) -> bool:
        """Whether a step is being computed that will change the document."""
        return self._stepping.applying

    def cancel(self, channel: str) -> None:
        """Stop the work of a channel; what was reached so far stays."""
        if channel == "write":
            self.noticed.emit(f"{self.writing.names} was not written; what was there before stays")
            self.writing.cancel()
            return
        self.jobs.cancel(channel, asked=True)
        document = self.document
        if channel == "decompose" and document is not None and self.decomposition is None:
            # Not even the base is there: without it a region is of no use.
            self._showing.forget_region_asked()
            self._refuse_region(document)
        elif channel == "solve":
            self.noticed.emit("The preview was stopped; {edit.apply} still applies what you set")

    def close(self) -> None:
        """Stop the engine thread."""
        self._showing.stop()
        self.jobs.stop()

    # ---- changing the document

    def start(self, document: Document, label: str = "Opened", path: Path | None = None) -> None:
        """Begin a new history with `document`."""
        self.take_up(History(document, label), path)

    def take_up(
        self, history: History, path: Path | None = None, stamp: Stamp | None = None
    ) -> None:
        """Go on with a whole history, as it was read from a file or recovered."""
        self.jobs.cancel("apply")
        self._showing.clear()
        self.jobs.memo.clear()
        self.history = history
        self.path = path
        self.stamp = stamp
        with self.turn.under_way():
            self.opened.emit()
            self._moved_on(flowing=False)

    def change(self, document: Document, label: str) -> None:
        """Make `document` the current one."""
        assert self.history is not None
        before = self.history.current
        began = before.draft.roi is not document.draft.roi
        self.history.add(on_both_sides(document, before), label)
        self._coalescing = None
        self._moved_on(flowing=began)

    def adjust(self, document: Document, label: str) -> None:
        """Make `document` the current one; a run of adjustments with one label is one moment."""
        assert self.history is not None
        if self._coalescing == (self.history.current_id, label):
            self.history.amend(document)
        else:
            moment = self.history.add(document, label)
            self._coalescing = (moment.id, label)
        self._moved_on(flowing=False)

    def choose_region(self, roi: I64 | None, label: str, *, curves_stay: bool = False) -> None:
        """Take another region; an empty one is none.

        With `curves_stay` what was drawn stays if all of it lies on that region too.
        """
        document = self.document
        if document is not None:
            wanted = None if roi is None or len(roi) == 0 else frozen(roi, np.int64)
            self.told.emit("")  # what was said of the region before is no longer of use
            draft = document.draft
            draft = resized(draft, wanted) if curves_stay else draft.with_roi(wanted)
            self.change(document.with_draft(draft), label)

    def keep_region(self, name: str, *, forget: bool = False) -> None:
        """Keep the region in the document under a name, or forget the one of that name."""
        document = self.document
        if document is not None:
            roi = None if forget else document.draft.roi
            label = "Region forgotten" if forget else f"Region kept: {name}"
            self.change(document.with_region(name, roi), label)

    def keep_view(self, name: str, view: View) -> None:
        """Keep a camera in the document under a name."""
        if self.document is not None:
            self.change(self.document.with_view(name, view), f"View kept: {name}")

    def forget_view(self, name: str) -> None:
        """Forget the camera kept under a name."""
        if self.document is not None:
            self.change(self.document.with_view(name, None), "View forgotten")

    def slide_level(self, level: float) -> None:
        """Show the region at another level of detail, 0 (base) to 1 (everything)."""
        document = self.document
        if document is None or document.draft.roi is None:
            return
        level = min(max(float(level), 0.0), 1.0)
        if level != document.draft.level or self.rests_on_details:
            draft = replace(document.draft, level=level)
            self.adjust(document.with_draft(draft), "Level")

    def begin_at(self, level: float) -> None:
        """Show the region just chosen at another level than its base; it is one moment with it."""
        document = self.document
        if document is not None and document.draft.roi is not None and self.history is not None:
            draft = replace(document.draft, level=min(max(float(level), 0.0), 1.0))
            self.history.amend(document.with_draft(draft))
            self._coalescing = None
            self._moved_on(flowing=True)

    def set_unit(self, unit: str) -> None:
        """Say what one mesh unit is; nothing is scaled."""
        document = self.document
        if document is not None and unit != document.unit:
            self.change(replace(document, unit=unit), f"Unit: {unit}")

    def set_options(self, options: EditOptions) -> None:
        """Solve the edit in another way."""
        document = self.document
        if document is not None and options != document.draft.options:
            self.adjust(document.with_draft(replace(document.draft, options=options)), "Options")

    def step_back(self) -> None:
        """Stop the step being computed, or drop what was drawn last."""
        if self.applying:
            self.jobs.cancel("apply", asked=True)
            return
        back = None if self.document is None else one_step_back(self.document)
        if back is not None:
            self.told.emit("")  # what was said of it is no longer of use
            self.change(*back)

    # ---- travelling in the history

    def undo(self) -> None:
        """Go one moment back."""
        if self.history is not None and self.history.can_undo:
            self._travel(self.history.undo)

    def redo(self) -> None:
        """Go one moment forward again."""
        if self.history is not None and self.history.can_redo:
            self._travel(self.history.redo)

    def go(self, moment_id: int) -> None:
        """Go to any moment of the history."""
        history = self.history
        if history is not None and moment_id in history.moments:
            self._travel(lambda: history.go(moment_id))

    def rename(self, moment_id: int, name: str) -> None:
        """Give a moment a name; an empty one takes its name away."""
        history = self.history
        if history is None or moment_id not in history.moments:
            return
        moment = history.moments[moment_id]
        wanted = "" if name == moment.label else name
        if wanted != moment.name:
            history.rename(moment_id, wanted)
            self.document_changed.emit()

    def _travel(self, way: Callable[[], Document]) -> None:
        self.jobs.cancel("apply")
        self._showing.drop_preview()
        self._coalescing = None
        self.told.emit("")
        way()
        self._moved_on(flowing=False)

    def _moved_on(self, *, flowing: bool) -> None:
        document = self.document
        assert document is not None
        with self.turn.under_way():
            self.problems.clear()
            self._showing.follow(document, details=self.rests_on_details)
            self.document_changed.emit()
            self._showing.show(flowing)
            self.busy_changed.emit()

    # ---- steps and previews

    def apply(self, step: Step) -> None:
        """Compute `step` in the background and add it to the document."""
        if self.document is not None and not self.applying:
            self._showing.drop_preview()
            self._stepping.apply(step, self.document)

    def preview(self, change: Document | Step) -> None:
        """Show what `change` would give, as soon as it is known; the newest wins."""
        if self.document is None:
            return
        if isinstance(change, Document):
            self._showing.preview(change)
        else:
            self._stepping.preview(change, self.document)

    def end_preview(self) -> None:
        """Show the current document again."""
        self.jobs.cancel("solve")
        self._showing.end_preview()

    def _take_step(self, document: Document, step: Step, mesh: Mesh) -> None:
        if self.document is document and self.history is not None:
            self.history.add(document.with_step(step, mesh), step.title)
            self._coalescing = None
            self._moved_on(flowing=True)
            self.applied.emit()

    def _look_at_step(self, document: Document, mesh: Mesh) -> None:
        if self.document is document and mesh.faces is document.mesh.faces:
            self._showing.preview_mesh(mesh)

    def _step_given_up(self) -> None:
        self._showing.drop_preview()
        self._showing.show()

    # ---- a region that is of no use

    def _region_failed(self, document: Document, error: Exception) -> None:
        if self.decomposition is None:
            self._refuse_region(document)
        self.problems.report(error)

    def _refuse_region(self, document: Document) -> None:
        """Forget a region that cannot be decomposed: the document is as it was before it."""
        history, moment = self.history, self.moment
        if history is None or moment is None or moment.parent is None:
            return
        before = history.moments[moment.parent].document
        same = moment.document.draft.roi is document.draft.roi
        if same and before.draft.roi is not document.draft.roi:
            history.take_back()
            self._moved_on(flowing=False)
