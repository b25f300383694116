"""Tool context: what a tool sees of the window and may do with it."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.drawing_surface import DrawingSurface
from app.nonsense import NonsenseError, refuse_nonsense
from app.session import Session
from app.toolbox import Toolbox
from engine import Decomposition, Document, Mesh, Step, View
from engine.arrays import F64, I64
from plugins.api import Hit, Role, Side, Tool

SPAN = "span"


class ToolContext(QObject):
    """The `plugins.api.Context` of the tool in hand; it cleans up what a tool leaves on screen.

    Attributes
    ----------
    tool : the tool in hand, or None.

    Signals
    -------
    said(text) : the tool's own sentence for the hint line; "" when it has nothing more to say.
    """

    said = Signal(str)

    def __init__(
        self,
        session: Session,
        canvas: DrawingSurface,
        toolbox: Toolbox,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.tool: Tool | None = None
        self._session = session
        self._canvas = canvas
        self._toolbox = toolbox
        self._marked = False
        self._spanned = False

    def end_gesture(self) -> None:
        """Take away what was shown for a gesture."""
        self._canvas.clear_ink()
        self.said.emit("")

    def unmark(self) -> None:
        """Show the region of the document again, after a gesture that showed another."""
        if self._marked:
            self._marked = False
            document = self._session.document
            self._canvas.set_region(None if document is None else document.draft.roi)

    def unspan(self) -> None:
        """Take away the line between two points."""
        if self._spanned:
            self._canvas.hide_curve(SPAN)
            self._spanned = False

    # ---- what tools see

    @property
    def document(self) -> Document:
        """The document as it is now."""
        assert self._session.document is not None
        return self._session.document

    @property
    def options(self) -> Any:
        """The active tool's options."""
        assert self.tool is not None
        return self._toolbox.options_of(self.tool.id)

    @property
    def view(self) -> View:
        """The camera as it is now."""
        return self._canvas.view()

    @property
    def shown(self) -> Mesh:
        """The surface as it is displayed."""
        assert self._session.shown is not None
        return self._session.shown

    @property
    def decomposition(self) -> Decomposition | None:
        """What is known of the region so far."""
        return self._session.decomposition

    def towards(self, side: Side) -> F64:
        """Unit direction to a side of the form."""
        return self._canvas.towards(side)

    def pick(self, x: float, y: float) -> Hit | None:
        """What is visible at a pixel."""
        return self._canvas.pick(x, y)

    def vertices_inside(self, polygon: F64, through: bool = False) -> I64:
        """Ids of the vertices inside a closed lasso."""
        return self._canvas.vertices_inside(polygon, through)

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Ids of the vertices within `radius` px of a pixel."""
        return self._canvas.vertices_near(x, y, radius, through)

    def faces_at(self, points: F64) -> I64:
        """Ids of the visible faces at many pixels, -1 for none."""
        return self._canvas.faces_at(points)

    def faces_under(self, path: F64) -> I64:
        """Ids of the visible faces below a path."""
        return self._canvas.faces_under(path)

    # ---- what tools show

    def mark(self, ids: I64 | None) -> None:
        """Show `ids` as the region until the gesture ends."""
        self._marked = True
        self._canvas.set_region(ids)

    def draw(self, path: F64, role: Role, closed: bool = False) -> None:
        """Show ink over the scene."""
        self._canvas.ink(path, role, closed)

    def preview(self, change: Document | Step) -> None:
        """Show what `change` would give."""
        if isinstance(change, Document):
            refuse_nonsense(self.document, change)
        elif not isinstance(change, Step):
            raise NonsenseError(f"it previews {type(change).__name__}, not a document or a step")
        elif self.tool is not None:
            self._toolbox.note_step(change, self.tool)
        self._session.preview(change)

    def notice(self, text: str) -> None:
        """Put a sentence where the hint is for some seconds."""
        self._session.told.emit(text)

    def span(self, first: F64, last: F64, text: str) -> None:
        """Show a line between two points with words until the tool is put away."""
        self._canvas.show_curve(SPAN, np.array([first, last]), "guide", label=text)
        self._spanned = True

    def say(self, text: str) -> None:
        """Put a sentence where the hint is."""
        self.said.emit(text)
