"""Symmetry: the plane across which what is drawn is mirrored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import engine
from app.session import Session
from engine import Mesh

CHANNEL = "symmetry"
MISFIT = 0.01  # share of the diagonal: a model this far off the plane is not symmetric

Axis = Literal["x", "y", "z"]
Which = Literal["off", "found", "x", "y", "z"]
AXES: tuple[Axis, ...] = ("x", "y", "z")


class Symmetry:
    """Sets the plane of symmetry of a session's document, and says which it is.

    Parameters
    ----------
    session : whose document it is.
    in_gesture : whether a hand draws; a plane found meanwhile is taken by `settle` afterwards, for
        a gesture ends when the document changes beneath it.
    """

    def __init__(self, session: Session, in_gesture: Callable[[], bool] = lambda: False) -> None:
        self._session = session
        self._in_gesture = in_gesture
        self._found: tuple[tuple[float, ...], float] | None = None  # plane, misfit
        self._looked_at: Mesh | None = None  # its plane is being found

    @property
    def which(self) -> Which:
        """Which plane edits are mirrored across, or will be as soon as it is found."""
        document = self._session.document
        if document is not None and document.mesh is self._looked_at:
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
        self._looked_at = self._found = None
        self._session.jobs.cancel(CHANNEL)
        if which == "off":
            self._take((), "Symmetry off")
        elif which == "found":
            self._find(document.mesh)
        else:
            plane = engine.middle_plane(document.mesh, which)
            self._take(plane, f"Symmetry across {which.upper()}")

    def settle(self) -> None:
        """Take the plane that was found, unless a hand draws."""
        if self._found is None or self._in_gesture():
            return
        (plane, misfit), mesh = self._found, self._looked_at
        self._looked_at = self._found = None
        document = self._session.document
        # A region chosen while the plane was looked for takes it as well.
        if document is None or document.mesh is not mesh:
            return
        self._take(tuple(plane), "Symmetry")
        if misfit > MISFIT:
            self._session.noticed.emit(
                f"The model is not quite symmetric: {misfit:.1%} of its size off the plane"
            )

    def _find(self, mesh: Mesh) -> None:
        self._looked_at = mesh

        def done(found: tuple[tuple[float, ...], float]) -> None:
            self._found = found
            self.settle()

        def failed(error: Exception) -> None:
            self._looked_at = None
            self._session.problems.report(error)

        self._session.jobs.submit(
            CHANNEL,
            lambda run: engine.symmetry_plane(mesh, run),
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
