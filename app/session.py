"""The one mutable cell: which document is current, what is computed for it, and what is shown."""

from __future__ import annotations

import logging
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import psutil
from PySide6.QtCore import QObject, QTimer, Signal

import engine
from app.jobs import Jobs
from engine import (
    Decomposition,
    Document,
    EditOptions,
    EditResult,
    EngineError,
    History,
    Mesh,
    Moment,
    Run,
    SketchEdit,
    Source,
    Step,
    StepError,
)
from engine.archive import DOCUMENT_SUFFIX, Archive, open_archive
from engine.arrays import F64, I64, frozen
from engine.files.place import write_file
from engine.view import View
from plugins.registry import kinds

log = logging.getLogger(__name__)

Key = tuple[int, int, str, bool]
Symmetry = Literal["off", "found", "x", "y", "z"]

HEAVY = 2**30  # bytes of memory: to open a file that takes more is worth a question
KEPT_DECOMPOSITIONS = 6
SYMMETRIC = 0.01  # share of the diagonal
HUNG = 10.0  # seconds without a sign after which a step that does not stop is to blame
REST_MS = 150  # a level that stays this long is worth a factorisation


def is_heavy(needed: int) -> bool:
    """Whether opening a file of so many bytes of memory is worth a question."""
    return needed > min(HEAVY, psutil.virtual_memory().available // 2)


class Session(QObject):
    """Owns the history, the engine's jobs, and what the window shows.

    Signals
    -------
    opened : another mesh is open; its history has begun.
    unpacked(archive) : what is open came from a document file, with what else was in it.
    imported(report) : the file was not taken as it stood; the report says what was done.
    document_changed : `document` is another one than before.
    shown_changed(flowing) : `shown` moved; `flowing` when it should be seen to move there.
    decomposition_changed : more is known about the region (base, then more and more modes).
    problem_changed : `problem` is another sentence, or none.
    broke(error) : a bug of ours came to light in the background; nothing was changed by it.
    misbehaved(step, reason, wrong) : a step raised, hung or gave nonsense and was given up; when
        not `wrong` it may only have been slow.
    heavy(path, clean, bytes) : a file takes much memory to open, and nobody said that it shall.
    noticed(text) : something worth a line happened (opened, exported).
    applied : a step was added.
    busy_changed : work began or ended in some channel.
    """

    opened = Signal()
    unpacked = Signal(object)
    imported = Signal(object)
    document_changed = Signal()
    shown_changed = Signal(bool)
    decomposition_changed = Signal()
    problem_changed = Signal()
    broke = Signal(object)
    misbehaved = Signal(object, str, bool)
    noticed = Signal(str)
    heavy = Signal(object, bool, object)
    applied = Signal()
    progressed = Signal(str, float, str)
    busy_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.jobs = Jobs(self)
        self.jobs.progressed.connect(self.progressed)
        self.jobs.idled.connect(lambda _channel: self.busy_changed.emit())
        self.history: History | None = None
        self.problem = ""
        self.solution: EditResult | None = None
        self.path: Path | None = None
        self._solved_edit: tuple[Mesh, SketchEdit] | None = None
        self._previewed: Document | None = None
        self._preview_mesh: Mesh | None = None
        self._kept: OrderedDict[Key, tuple[Any, ...]] = OrderedDict()
        self._shown: Mesh | None = None
        self._coalescing: tuple[int, str] | None = None
        self._asked: Key | None = None
        self._prepared: tuple[object, ...] | None = None
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.setInterval(REST_MS)
        self._resting.timeout.connect(self._prepare)

    # ---- what is open

    @property
    def document(self) -> Document | None:
        """The document as it is now, or None before the first file."""
        return None if self.history is None else self.history.current

    @property
    def subject(self) -> Document | None:
        """The document that is shown: the one that a gesture previews, or the current one."""
        return self._previewed or self.document

    @property
    def moment(self) -> Moment | None:
        """The current place in the history."""
        return None if self.history is None else self.history.moments[self.history.current_id]

    @property
    def applying(self) -> bool:
        """Whether a step is being computed that will change the document."""
        return self.jobs.busy("apply")

    @property
    def decomposition(self) -> Decomposition | None:
        """What is known about the current region so far."""
        document = self.document
        return None if document is None else self._decomposition_of(document)

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

    @property
    def target_error(self) -> float | None:
        """How far the farthest anchor is from its target, px; None without a solved stroke."""
        document = self.subject
        if document is None or not document.draft.acting or self.solution is None:
            return None
        return float(self.solution.target_error_px)

    def cancel(self, channel: str) -> None:
        """Stop the work of a channel; what was reached so far stays."""
        self.jobs.cancel(channel, asked=True)
        document = self.document
        if channel == "decompose" and document is not None and self.decomposition is None:
            # Not even the base is there: without it a region is of no use.
            self._asked = None
            self._refuse_region(document)
        self.busy_changed.emit()

    # ---- changing the document

    def start(self, document: Document, label: str = "Opened", path: Path | None = None) -> None:
        """Begin a new history with `document`."""
        self.take_up(History(document, label), path)

    def take_up(self, history: History, path: Path | None = None) -> None:
        """Go on with a whole history, as it was read from a file or recovered."""
        for channel in ("decompose", "prepare", "solve", "apply"):
            self.jobs.cancel(channel)
        self.jobs.memo.clear()
        self._kept.clear()
        self.history = history
        self.path = path
        self.opened.emit()
        self._moved_on(flowing=False)

    def change(self, document: Document, label: str) -> None:
        """Make `document` the current one."""
        assert self.history is not None
        began = self.history.current.draft.roi is not document.draft.roi
        document = self._mirrored(document)
        self.history.add(document, label)
        self._coalescing = None
        self._moved_on(flowing=began)

    def _mirrored(self, document: Document) -> Document:
        """With symmetry on, a region is one on both sides."""
        draft, before = document.draft, self.document
        if draft.roi is None or not draft.options.mirror or before is None:
            return document
        same = before.draft.roi is draft.roi and before.draft.options.mirror == draft.options.mirror
        if same:
            return document
        both = engine.mirrored_region(document.mesh, draft.roi, draft.options.mirror)
        if len(both) == len(draft.roi):
            return document
        return document.with_draft(replace(draft, roi=frozen(both, np.int64)))

    def adjust(self, document: Document, label: str) -> None:
        """Make `document` the current one; a run of adjustments with one label is one moment."""
        assert self.history is not None
        if self._coalescing == (self.history.current_id, label):
            self.history.amend(document)
        else:
            moment = self.history.add(document, label)
            self._coalescing = (moment.id, label)
        self._moved_on(flowing=False)

    def choose_region(self, roi: I64 | None, label: str) -> None:
        """Take another region; an empty one is none."""
        document = self.document
        if document is not None:
            wanted = None if roi is None or len(roi) == 0 else frozen(roi, np.int64)
            self.change(document.with_draft(document.draft.with_roi(wanted)), label)

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

    def set_symmetry(self, on: bool) -> None:
        """Mirror the region and what is drawn across the model's plane of symmetry, or stop."""
        document = self.document
        if document is None:
            return
        options = document.draft.options
        if not on:
            draft = replace(document.draft, options=replace(options, mirror=()))
            self.change(document.with_draft(draft), "Symmetry off")
            return

        def done(found: tuple[tuple[float, ...], float]) -> None:
            if self.document is not document:
                return
            plane, misfit = found
            draft = replace(document.draft, options=replace(options, mirror=tuple(plane)))
            self.change(document.with_draft(draft), "Symmetry")
            if misfit > SYMMETRIC:
                self.noticed.emit(
                    f"The model is not quite symmetric: {misfit:.1%} of its size off the plane"
                )

        self.jobs.submit(
            "symmetry",
            lambda _run: engine.symmetry_plane(document.mesh),
            done,
            self.report,
            priority=1,
        )

    def mirror_across(self, axis: Literal["x", "y", "z"]) -> None:
        """Mirror the region and what is drawn across an axis, through the model's middle."""
        document = self.document
        if document is not None:
            plane = engine.middle_plane(document.mesh, axis)
            options = replace(document.draft.options, mirror=plane)
            draft = replace(document.draft, options=options)
            self.change(document.with_draft(draft), f"Symmetry across {axis.upper()}")

    @property
    def symmetry(self) -> Symmetry:
        """Which plane edits are mirrored across."""
        document = self.document
        plane = () if document is None else document.draft.options.mirror
        if document is None or not plane:
            return "off"
        middle: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
        for axis in middle:
            if plane == engine.middle_plane(document.mesh, axis):
                return axis
        return "found"

    def slide_level(self, level: float) -> None:
        """Show the region at another level of detail, 0 (base) to 1 (everything)."""
        document = self.document
        if document is None or document.draft.roi is None:
            return
        level = min(max(float(level), 0.0), 1.0)
        if level != document.draft.level or self.rests_on_details:
            draft = replace(document.draft, level=level)
            self.adjust(document.with_draft(draft), "Level")

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

    def apply(self, step: Step) -> None:
        """Compute `step` in the background and add it to the document."""
        document = self.document
        if document is None or self.applying:
            return

        def done(mesh: Mesh) -> None:
            if self.document is document and self.history is not None:
                self.history.add(document.with_step(step, mesh), step.title)
                self._coalescing = None
                self._moved_on(flowing=True)
                self.applied.emit()

        def failed(error: Exception) -> None:
            self._refused(error)
            self._show(flowing=False)

        self._previewed = self._preview_mesh = None
        self.jobs.cancel("solve")
        self.jobs.submit(
            "apply",
            lambda run: engine.applied(step, document.mesh, run),
            done,
            failed,
            priority=1,
            stuck=self._leaving(step),
        )
        self.busy_changed.emit()

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
        self._previewed = self._preview_mesh = None
        self._coalescing = None
        way()
        self._moved_on(flowing=False)

    def step_back(self) -> None:
        """Drop what was drawn last: a target, else the source, else the region."""
        document = self.document
        if self.applying:
            self.jobs.cancel("apply", asked=True)
            return
        if document is None or document.draft.roi is None:
            return
        draft = document.draft
        if draft.source is not None:
            self.change(document.with_draft(replace(draft, source=None)), "Source dropped")
        elif draft.strokes:
            *kept, last = draft.strokes
            source = Source(last.anchors, last.view, last.closed, last.weights)
            back = replace(draft, source=source, strokes=tuple(kept))
            self.change(document.with_draft(back), "Target dropped")
        else:
            self.change(document.with_draft(draft.with_roi(None)), "Region left")

    # ---- previews

    def preview(self, change: Document | Step) -> None:
        """Show what `change` would give, as soon as it is known; the newest wins."""
        document = self.document
        if document is None:
            return
        if isinstance(change, Document):
            self._previewed = change
            self._compute()
            self._show(flowing=False)
            return
        step = change

        def done(mesh: Mesh) -> None:
            if self.document is document and mesh.faces is document.mesh.faces:
                self._preview_mesh = mesh
                self._show(flowing=False)

        self.jobs.submit(
            "solve",
            lambda run: engine.applied(step, document.mesh, run),
            done,
            self._refused,
            priority=0,
            overtakable=True,
            stuck=self._leaving(step),
        )

    def end_preview(self) -> None:
        """Show the current document again."""
        self.jobs.cancel("solve")
        self._previewed = self._preview_mesh = None
        self._compute()
        self._show(flowing=False)

    # ---- files

    def open(self, path: Path, *, clean: bool = True, sure: bool = False) -> None:
        """Open a mesh or a document in the background; what is open stays until it is there.

        Parameters
        ----------
        clean : repair what can be repaired; without, the file is taken as it is or refused.
        sure : open also a file that takes much memory, without asking by `heavy`.
        """
        if path.suffix.lower() == DOCUMENT_SUFFIX:
            self._open_document(path)
            return

        def work(run: Run) -> Any:
            needed = 0 if sure else engine.estimate(path)
            return needed if is_heavy(needed) else engine.open_file(path, clean, run)

        def done(imported: Any) -> None:
            if isinstance(imported, int):
                self.heavy.emit(path, clean, imported)
                return
            self.start(Document.open(imported.mesh, path.name), path=path)
            report = imported.report
            if report.changed or report.warnings:
                self.imported.emit(report)

        self.jobs.submit("file", work, done, self.report, priority=1)
        self.busy_changed.emit()

    def _open_document(self, path: Path) -> None:
        def done(archive: Archive) -> None:
            # What was lost of a damaged file may yet be wanted: it is not saved over.
            self.take_up(archive.history, None if archive.report else path)
            self.unpacked.emit(archive)
            if archive.report:
                self.fail(" ".join(archive.report))

        self.jobs.submit(
            "file", lambda _run: open_archive(path, kinds()), done, self.report, priority=1
        )
        self.busy_changed.emit()

    def export(self, path: Path) -> None:
        """Write the mesh as it is after the steps applied so far, in the background."""
        document = self.document
        if document is None:
            return
        mesh = document.mesh
        self.jobs.submit(
            "file",
            lambda _run: engine.save(mesh, path),
            lambda _none: self.noticed.emit(f"Exported to {path.name}"),
            self.report,
            priority=1,
        )
        self.busy_changed.emit()

    def export_recipe(self, path: Path) -> None:
        """Write the steps applied so far as a recipe that replays without a window."""
        document = self.document
        if document is None:
            return
        try:
            write_file(path, document.recipe.to_json().encode("utf-8"))
        except EngineError as error:
            self.report(error)
            return
        self.noticed.emit(f"Recipe saved to {path.name}")

    def close(self) -> None:
        """Stop the engine thread."""
        self._resting.stop()
        self.jobs.stop()

    # ---- problems

    def report(self, error: Exception) -> None:
        """Show an error: an `EngineError` as it stands, anything else as a bug of ours."""
        if isinstance(error, EngineError):
            self.fail(str(error))
        else:
            self.fail(
                f"Something went wrong in Eigenform itself ({type(error).__name__}: {error}). "
                "Your document is as it was."
            )
            self.broke.emit(error)

    def _refused(self, error: Exception) -> None:
        """Show why a step was not done; one that misbehaved is the business of its tool."""
        if isinstance(error, StepError):
            self.misbehaved.emit(error.step, error.reason, True)
        else:
            self.report(error)

    def _leaving(self, step: Step) -> Callable[[float], None] | None:
        """Return what to do when a step hangs; our own edit may take its time on a large mesh."""
        if isinstance(step, SketchEdit):
            return None
        return lambda silent: self._left_behind(step, silent)

    def _left_behind(self, step: Step, silent: float) -> None:
        """A step did not come back: go on without it."""
        # The same step may wait to be applied after its preview.
        self.jobs.cancel("apply")
        self._previewed = self._preview_mesh = None
        if silent > HUNG:
            self.misbehaved.emit(step, f"gave no sign of life for {silent:.0f} seconds", True)
        else:
            self.misbehaved.emit(step, "did not stop when it was told to", False)
        self._show(flowing=False)
        self.busy_changed.emit()

    def fail(self, sentence: str) -> None:
        """Show a sentence where the person looks, until the next action."""
        self.problem = sentence
        self.problem_changed.emit()

    def clear_problem(self) -> None:
        """Take the sentence away."""
        if self.problem:
            self.problem = ""
            self.problem_changed.emit()

    # ---- what is computed

    def _moved_on(self, *, flowing: bool) -> None:
        self.clear_problem()
        self._previewed = self._preview_mesh = None
        self._compute()
        self.document_changed.emit()
        self._show(flowing=flowing)
        self.busy_changed.emit()

    def _compute(self) -> None:
        """Ask the engine for what the subject needs and nobody has asked for yet."""
        document = self.subject
        if document is None:
            return
        self._ask_decomposition(document)
        edit = document.draft.edit()
        if edit is None:
            self.jobs.cancel("solve")
            self.solution = self._solved_edit = None
            self._prepare_soon(document)
        elif self._solved_edit is None or not _same_edit(self._solved_edit, document.mesh, edit):
            self._ask_solution(document, edit)

    def _ask_decomposition(self, document: Document) -> None:
        roi, options = document.draft.roi, document.draft.options
        if roi is None:
            self.jobs.cancel("decompose")
            self._asked = None
            return
        known = self._decomposition_of(document)
        key = _key(document)
        if key == self._asked or (known is not None and known.complete):
            return
        self._asked = key
        mesh = document.mesh

        def work(run: Run) -> Iterator[Decomposition]:
            yield from engine.decompose_stream(
                mesh, roi, rim=options.rim, run=run, free_borders=options.free_borders
            )

        def done(decomposition: Decomposition) -> None:
            first = key not in self._kept
            self._kept[key] = (decomposition, mesh, roi)
            self._kept.move_to_end(key)
            while len(self._kept) > KEPT_DECOMPOSITIONS:
                self._kept.popitem(last=False)
            self.decomposition_changed.emit()
            self._prepare_soon(self.document)
            self._show(flowing=first)

        def failed(error: Exception) -> None:
            self._asked = None
            if key not in self._kept:
                self._refuse_region(document)
            self.report(error)

        self.jobs.submit("decompose", work, done, failed, priority=5)
        self.busy_changed.emit()

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

    def _prepare_soon(self, document: Document | None) -> None:
        """Factorise at once for a source that was drawn, else when the level has come to rest."""
        if document is None or document.draft.roi is None or document.draft.acting:
            self._resting.stop()
        elif document.draft.source is not None:
            self._resting.stop()
            self._prepare()
        else:
            self._resting.start()

    def _prepare(self) -> None:
        """Factorise for the level and the source that waits, before the target is drawn."""
        document = self.document
        if document is None or document.draft.roi is None:
            return
        draft, mesh = document.draft, document.mesh
        known = self._decomposition_for(document)
        wanted = (_key(document), draft.level, draft.options, draft.source)
        if known is None or wanted == self._prepared:
            return
        self._prepared = wanted
        waiting = () if draft.source is None else (draft.source.still(mesh),)
        edit = SketchEdit(draft.roi, draft.level, (*draft.acting, *waiting), draft.options)
        self.jobs.submit(
            "prepare",
            lambda run: edit.prepare(mesh, run, known),
            lambda _prepared: None,
            self.report,
            priority=2,
            urgent=True,
        )

    def _ask_solution(self, document: Document, edit: SketchEdit) -> None:
        mesh, known = document.mesh, self._decomposition_for(document)

        def done(result: EditResult) -> None:
            subject = self.subject
            now = None if subject is None else subject.draft.edit()
            if subject is None or subject.mesh is not mesh or now is None:
                return
            self.solution, self._solved_edit = result, (mesh, edit)
            self._show(flowing=False)

        self.jobs.submit(
            "solve",
            lambda run: edit.prepare(mesh, run, known).solve(edit.strokes),
            done,
            self.report,
            priority=0,
            urgent=known is not None,
            overtakable=True,
        )

    def _decomposition_of(self, document: Document) -> Decomposition | None:
        kept = self._kept.get(_key(document)) if document.draft.roi is not None else None
        return None if kept is None else kept[0]

    def _decomposition_for(self, document: Document) -> Decomposition | None:
        """What is known already, if it is enough for the level: the same numbers, sooner."""
        known = self._decomposition_of(document)
        return known if known is not None and known.reaches(document.draft.level) else None

    # ---- what is shown

    @property
    def shown(self) -> Mesh | None:
        """The surface as it is displayed: at the level, deformed, or the mesh itself."""
        return self._shown

    def _show(self, *, flowing: bool) -> None:
        document = self.subject
        if document is None:
            return
        positions = self._positions(document)
        if positions is None:
            return  # a solve is under way: what is shown stays until it is there
        if positions is document.mesh.vertices:
            self._shown = document.mesh
        else:
            self._shown = document.mesh.with_vertices(positions)
        self.shown_changed.emit(flowing)

    def _positions(self, document: Document) -> F64 | None:
        """Positions (n, 3) to show for a document; None while they are being computed."""
        mesh, draft = document.mesh, document.draft
        if self._preview_mesh is not None:
            return self._preview_mesh.vertices
        if draft.roi is None or (self._previewed is None and self.rests_on_details):
            return mesh.vertices
        if draft.acting:
            if self.solution is None or self._solved_edit is None:
                return self._level_positions(document)
            if self._solved_edit[0] is mesh:
                return self.solution.level_vertices
        return self._level_positions(document)

    def _level_positions(self, document: Document) -> F64:
        decomposition = self._decomposition_of(document)
        if decomposition is None:
            return document.mesh.vertices
        positions = document.mesh.vertices.copy()
        positions[decomposition.roi] = decomposition.surface(
            decomposition.mode_count(document.draft.level)
        )
        positions.flags.writeable = False  # the mesh made of it then takes it without a copy
        return positions


def _key(document: Document) -> Key:
    """Identity of what a decomposition depends on; the kept entry holds the objects alive."""
    options = document.draft.options
    return (id(document.mesh), id(document.draft.roi), options.rim, options.free_borders)


def _same_edit(solved: tuple[Mesh, SketchEdit], mesh: Mesh, edit: SketchEdit) -> bool:
    before_mesh, before = solved
    return (
        before_mesh is mesh
        and before.roi is edit.roi
        and before.level == edit.level
        and before.options == edit.options
        and len(before.strokes) == len(edit.strokes)
        and all(a is b for a, b in zip(before.strokes, edit.strokes, strict=True))
    )
