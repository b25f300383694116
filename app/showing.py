"""Showing: the surface that is displayed, and what the engine must still find out for it."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from app.decomposing import Decomposing
from app.form import Form
from app.jobs import Jobs
from app.solving import Solving
from engine import Decomposition, Document, Mesh


class Showing(QObject):
    """Follows the current document, or the one that a gesture previews instead.

    Its region is shown at the level, deformed as it is drawn. What is not known yet is asked for;
    until it is there, the form is shown as far as it is known.

    Signals
    -------
    changed(flowing) : `form` is another; `flowing` when it should be seen to move there.
    decomposition_changed : more is known about the region (base, then more and more modes).
    region_failed(document, error) : the region of `document` cannot be taken apart.
    failed(error) : what is drawn cannot be solved.
    """

    changed = Signal(bool)
    decomposition_changed = Signal()
    region_failed = Signal(object, object)
    failed = Signal(object)

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.form: Form | None = None
        self._document: Document | None = None
        self._details = False
        self._previewed: Document | None = None
        self._preview_mesh: Mesh | None = None
        self._decomposing = Decomposing(jobs, self)
        self._solving = Solving(jobs, self._decomposing, self)
        self._decomposing.grew.connect(self._grown)
        self._decomposing.failed.connect(self.region_failed)
        self._solving.solved.connect(self.show)
        self._solving.failed.connect(self.failed)

    # ---- what is known

    @property
    def subject(self) -> Document | None:
        """The document that is shown: the one that a gesture previews, or the current one."""
        return self._previewed or self._document

    @property
    def decomposition(self) -> Decomposition | None:
        """What is known about the current region so far."""
        document = self._document
        return None if document is None else self._decomposing.of(document)

    @property
    def target_error(self) -> float | None:
        """How far the farthest anchor is from its target, px; None without a solved stroke."""
        document = self.subject
        if document is None or not document.draft.acting:
            return None
        result = self._solving.result_on(document.mesh)
        return None if result is None else float(result.target_error_px)

    # ---- what to show

    def follow(self, document: Document, *, details: bool) -> None:
        """Ask for what the current document needs; `show` then shows it.

        Parameters
        ----------
        details : show the mesh with all its details, whatever the level is.
        """
        self._document, self._details = document, details
        self.drop_preview()
        self._ask()

    def preview(self, document: Document) -> None:
        """Show a document that is not the current one."""
        self._previewed = document
        self._ask()
        self.show()

    def preview_mesh(self, mesh: Mesh) -> None:
        """Show a mesh instead of what the current document says."""
        self._preview_mesh = mesh
        self.show()

    def drop_preview(self) -> None:
        """Forget what was previewed; what is shown stays for now."""
        self._previewed = self._preview_mesh = None

    def end_preview(self) -> None:
        """Show the current document again."""
        self.drop_preview()
        self._ask()
        self.show()

    def forget_region_asked(self) -> None:
        """The decomposition under way was cancelled; it may be asked for again."""
        self._decomposing.forget_asked()

    def clear(self) -> None:
        """Forget all that was computed, for another file."""
        self._document = None
        self.drop_preview()
        self._decomposing.clear()
        self._solving.clear()

    def stop(self) -> None:
        """Ask for nothing more by itself, for closing."""
        self._solving.stop()

    def show(self, flowing: bool = False) -> None:
        """Show what is known now."""
        document = self.subject
        if document is None:
            return
        self.form = self._form(document)
        self.changed.emit(flowing)

    def _ask(self) -> None:
        """Ask the engine for what the subject needs and nobody has asked for yet."""
        subject = self.subject
        if subject is None:
            return
        self._decomposing.ask(subject)
        self._solving.ask(subject, moving=self._previewed is not None)
        if self._document is not None and subject is self._document:
            self._solving.prepare_soon(self._document)

    def _grown(self, first: bool) -> None:
        self.decomposition_changed.emit()
        if self._document is not None:
            self._solving.prepare_soon(self._document)
        self.show(flowing=first)

    def _form(self, document: Document) -> Form:
        """Return what to show for a document, as far as it is known."""
        mesh, draft = document.mesh, document.draft
        if self._preview_mesh is not None:
            return Form(self._preview_mesh)
        if draft.roi is None or (self._previewed is None and self._details):
            return Form(mesh)
        solved = self._solving.result_on(mesh) if draft.acting else None
        if solved is not None:
            return Form(mesh, solved.roi, solved.level_vertices[solved.roi])
        known = self._decomposing.of(document)
        if known is None:
            return Form(mesh)
        return Form(mesh, known.roi, known.surface(known.mode_count(draft.level)))
