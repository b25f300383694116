"""Symmetry: the plane across which what is drawn is mirrored."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import engine
from app.session import Session
from engine import Document

CHANNEL = "symmetry"
MISFIT = 0.01  # share of the diagonal: a model this far off the plane is not symmetric

Axis = Literal["x", "y", "z"]
Which = Literal["off", "found", "x", "y", "z"]
AXES: tuple[Axis, ...] = ("x", "y", "z")


class Symmetry:
    """Sets the plane of symmetry of a session's document, and says which it is."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._looked_at: Document | None = None  # its plane is being found

    @property
    def which(self) -> Which:
        """Which plane edits are mirrored across, or will be as soon as it is found."""
        document = self._session.document
        if document is not None and document is self._looked_at:
            return "found"
        plane = () if document is None else document.draft.options.mirror
        if document is None or not plane:
            return "off"
        for axis in AXES:
            if plane == engine.middle_plane(document.mesh, axis):
                return axis
        return "found"

    def choose(self, which: Which) -> None:
        """Mirror the region and what is drawn across a plane, or stop.

        Parameters
        ----------
        which : an axis for the plane across it through the model's middle, or "found" for the plane
            on which the model is most symmetric, wherever it lies.
        """
        document = self._session.document
        if document is None:
            return
        self._looked_at = None
        self._session.jobs.cancel(CHANNEL)
        if which == "off":
            self._take((), "Symmetry off")
        elif which == "found":
            self._find(document)
        else:
            plane = engine.middle_plane(document.mesh, which)
            self._take(plane, f"Symmetry across {which.upper()}")

    def _find(self, document: Document) -> None:
        self._looked_at = document

        def done(found: tuple[tuple[float, ...], float]) -> None:
            self._looked_at = None
            if self._session.document is not document:
                return
            plane, misfit = found
            self._take(tuple(plane), "Symmetry")
            if misfit > MISFIT:
                self._session.noticed.emit(
                    f"The model is not quite symmetric: {misfit:.1%} of its size off the plane"
                )

        def failed(error: Exception) -> None:
            self._looked_at = None
            self._session.problems.report(error)

        self._session.jobs.submit(
            CHANNEL,
            lambda _run: engine.symmetry_plane(document.mesh),
            done,
            failed,
            priority=1,
        )

    def _take(self, plane: tuple[float, ...], label: str) -> None:
        document = self._session.document
        if document is not None:
            draft = document.draft
            draft = replace(draft, options=replace(draft.options, mirror=plane))
            self._session.change(document.with_draft(draft), label)
