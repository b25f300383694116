"""Feeds pointer events to the active tool's generator, and guards the window against tools.

A tool is a stranger: it may raise, return nonsense or change what it must not. Then its gesture is
closed, the person is told its name, and the document stays as it was.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.patience import Patience
from app.session import Session
from engine import (
    Cancelled,
    Decomposition,
    Document,
    Draft,
    EngineError,
    Mesh,
    SketchEdit,
    Source,
    Step,
    View,
)
from engine.arrays import F64, I64
from plugins.api import Gesture, Hit, Pointer, Role, Tool

log = logging.getLogger(__name__)

SPAN = "span"
KEPT = ("original", "mesh", "recipe")  # of a document; only a step changes these


class Canvas(Protocol):
    """What the tool host needs of the viewport; all positions in logical pixels."""

    def view(self) -> View: ...

    def pick(self, x: float, y: float) -> Hit | None: ...

    def vertices_inside(self, polygon: F64, through: bool = False) -> I64: ...

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64: ...

    def faces_under(self, path: F64) -> I64: ...

    def set_region(self, ids: I64 | None) -> None: ...

    def brush(self, x: float, y: float, radius: float | None) -> None: ...

    def ink(self, path: F64, role: Role, closed: bool = False) -> None: ...

    def clear_ink(self) -> None: ...

    def show_curve(self, name: str, points: F64, role: str, *, label: str) -> None: ...

    def hide_curve(self, name: str) -> None: ...


class NonsenseError(Exception):
    """A tool returned something that is neither a document, a step nor None."""


def refuse_nonsense(before: Document, after: Document) -> None:
    """Refuse a document that no tool may make of `before`.

    Raises
    ------
    NonsenseError
    """
    kept = all(getattr(after, name) is getattr(before, name) for name in KEPT)
    if not kept:
        raise NonsenseError("it changed the mesh without a step")
    draft = after.draft
    if not isinstance(draft, Draft):
        raise NonsenseError("its draft is none")
    if draft.roi is not before.draft.roi and draft.roi is not None:
        _refuse_ids(draft.roi, before.mesh.n, "its region")
    if draft.source is not None and draft.source is not before.draft.source:
        if not isinstance(draft.source, Source):
            raise NonsenseError("its source is none")
        _refuse_ids(np.sort(draft.source.anchors), before.mesh.n, "its source")
    try:
        SketchEdit(np.zeros(0, np.int64), draft.level, draft.strokes, draft.options).check(
            before.mesh
        )
    except (EngineError, AttributeError, TypeError, ValueError) as error:
        raise NonsenseError(f"its draft cannot be solved: {error}") from error


def _refuse_ids(ids: object, n: int, what: str) -> None:
    good = isinstance(ids, np.ndarray) and ids.ndim == 1 and ids.dtype.kind in "iu" and len(ids)
    if not good:
        raise NonsenseError(f"{what} is not an array of vertex ids")
    assert isinstance(ids, np.ndarray)
    if ids.min() < 0 or ids.max() >= n or (np.diff(ids) <= 0).any():
        raise NonsenseError(f"{what} is not ascending vertex ids below {n}")


class ToolHost(QObject):
    """Holds the active tool and its gesture; is the `Context` that tools see.

    Signals
    -------
    tool_changed : another tool is active, or its options are others.
    said(text) : the tool's own sentence for the hint line; "" when it has nothing more to say.
    gesture_changed : a gesture began or ended.
    """

    tool_changed = Signal()
    said = Signal(str)
    gesture_changed = Signal()

    def __init__(
        self,
        session: Session,
        canvas: Canvas,
        tools: Mapping[str, Tool],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._canvas = canvas
        self.tools = dict(tools)
        self.switched_off: set[str] = set()
        self._options: dict[str, Any] = {name: tool.Options() for name, tool in tools.items()}
        self._active = next(iter(self.tools), "")
        self._gesture: Gesture | None = None
        self._pressed = False
        self._marked = False
        self._spanned = False
        self.reasons: dict[str, str] = {}
        self._patience = Patience()
        self._makers: dict[type, Tool] = {}
        session.opened.connect(self._opened)
        session.document_changed.connect(self._follow)
        session.misbehaved.connect(self._misbehaved)

    # ---- which tool

    @property
    def active(self) -> Tool | None:
        """The tool in hand."""
        return self.tools.get(self._active)

    @property
    def in_gesture(self) -> bool:
        """Whether a gesture is under way."""
        return self._gesture is not None

    def choose(self, name: str) -> None:
        """Take another tool in hand."""
        if name not in self.tools or name in self.switched_off:
            return
        self.cancel()
        self._unspan()
        self._active = name
        self._canvas.brush(0.0, 0.0, None)  # the next move of the hand shows what it takes now
        self._session.problems.clear()
        self._show_live()
        self.tool_changed.emit()

    def available(self, name: str) -> bool:
        """Whether a tool can be used on the document now."""
        document = self._session.document
        if document is None or name in self.switched_off:
            return False
        return bool(self._asked(self.tools[name], "available", document, False))

    def hint(self) -> str:
        """What the active tool says about the document."""
        document, tool = self._session.document, self.active
        if document is None or tool is None:
            return ""
        return str(self._asked(tool, "hint", document, tool.tip))

    def set_options(self, name: str, options: Any) -> None:
        """Give a tool other options."""
        self._options[name] = options
        self._show_live()
        self.tool_changed.emit()

    def options_of(self, name: str) -> Any:
        """The options of a tool as the person set them."""
        return self._options[name]

    def _opened(self) -> None:
        self.cancel()
        self._hand_over()

    def _follow(self) -> None:
        # The document went on beneath a gesture (undo by a key, a late refusal): the gesture works
        # on what is no more, and another tool may take over now.
        self.cancel()
        tool = self.active
        if tool is None or not tool.repeats or not self.available(self._active):
            self._hand_over()
        elif tool.live and not self._session.rests_on_details:
            self._show_live()
        self.tool_changed.emit()

    def _hand_over(self) -> None:
        """The flow goes on with the first tool that claims the document."""
        document = self._session.document
        if document is None:
            return
        for name, tool in self.tools.items():
            if self._asked(tool, "claims", document, False):
                self._active = name
                break
        self.tool_changed.emit()

    def _show_live(self) -> None:
        """Preview what Enter would do, for a tool that is set by its options alone."""
        tool = self.active
        if tool is None or not tool.live or not self.available(self._active):
            self._session.end_preview()
            return
        try:
            result = self._entered(tool)
            if isinstance(result, Document | Step):
                self.preview(result)
        except EngineError as error:
            self._session.problems.report(error)
        except Exception as error:
            log.info("Tool %s raised", self._active, exc_info=True)
            self._fail(tool, error)

    # ---- gestures

    def pointer(self, event: Pointer) -> None:
        """Take one event of mouse or pen."""
        self._show_circle(event)
        self._pressed = event.kind == "press" or (self._pressed and event.kind == "move")
        if event.kind == "press" and self._gesture is None:
            self._begin(event)
        elif self._gesture is not None and event.kind != "hover":
            self._advance(event)

    def _show_circle(self, event: Pointer) -> None:
        tool = self.active
        if tool is None or self._session.document is None:
            return
        radius = None
        if self._active not in self.switched_off:
            radius = self._asked(tool, "circle", self._options[self._active], None)
        self._canvas.brush(event.x, event.y, radius if isinstance(radius, int | float) else None)

    def _unmark(self) -> None:
        """Show the region of the document again, after a gesture that showed another."""
        if self._marked:
            self._marked = False
            document = self._session.document
            self._canvas.set_region(None if document is None else document.draft.roi)

    def cancel(self) -> bool:
        """Close the gesture under way; returns whether there was one."""
        if self._gesture is None:
            return False
        tool, gesture = self.active, self._gesture
        self._gesture = None
        try:
            with self._patience.call():
                gesture.close()
        except Exception as error:
            log.info("Tool %s raised when it was closed", self._active, exc_info=True)
            self._fail(tool, error)
        self._put_away()
        return True

    def enter(self) -> None:
        """Do what Enter asks for: the active tool decides, by default it applies the draft."""
        tool = self.active
        if self._gesture is not None and tool is not None and tool.waits and not self._pressed:
            self._advance(Pointer("enter", 0.0, 0.0))
            return
        if self._gesture is not None or self._session.document is None or tool is None:
            return
        try:
            self._take(tool, self._entered(tool))
        except EngineError as error:
            self._session.problems.report(error)
        except Exception as error:
            log.info("Tool %s raised", self._active, exc_info=True)
            self._fail(tool, error)

    def can_enter(self) -> bool:
        """Whether Enter has something to do: strokes to apply, or a tool with its own answer."""
        document, tool = self._session.document, self.active
        if document is None or tool is None or self._session.applying:
            return False
        if self._gesture is not None and tool.waits:
            return True
        own = type(tool).enter is not Tool.enter
        return document.draft.edit() is not None or (own and self.available(self._active))

    def _entered(self, tool: Tool) -> object:
        """Return what the tool answers to Enter, within reasonable time."""
        self._patience.begin()
        try:
            with self._patience.call():
                return tool.enter(self)
        finally:
            self._patience.end()

    def _begin(self, event: Pointer) -> None:
        tool = self.active
        if tool is None or self._session.document is None or self._session.applying:
            return
        self._session.problems.clear()
        try:
            self._patience.begin()
            with self._patience.call():
                gesture = tool.gesture(self, event)
            if not hasattr(gesture, "send"):
                raise NonsenseError("its gesture is not a generator")
        except Exception as error:
            log.info("Tool %s raised", self._active, exc_info=True)
            self._patience.end()
            self._fail(tool, error)
            return
        self._gesture = gesture
        self.gesture_changed.emit()
        self._advance(None)

    def _advance(self, event: Pointer | None) -> None:
        tool, gesture = self.active, self._gesture
        assert tool is not None
        assert gesture is not None
        try:
            with self._patience.call():
                if event is None:
                    next(gesture)
                else:
                    gesture.send(event)
        except StopIteration as end:
            self._gesture = None
            self._finish(tool, end.value)
        except EngineError as error:
            self._gesture = None
            self._put_away()
            if not isinstance(error, Cancelled):
                self._session.problems.report(error)
        except Exception as error:
            log.info("Tool %s raised", self._active, exc_info=True)
            self._gesture = None
            self._put_away()
            self._fail(tool, error)

    def _finish(self, tool: Tool, result: object) -> None:
        self._patience.end()
        self._canvas.clear_ink()
        self.said.emit("")
        try:
            taken = self._take(tool, result)
        except NonsenseError as error:
            self._fail(tool, error)
            taken = False
        self._unmark()
        if not taken:
            self._session.end_preview()
        self.gesture_changed.emit()

    def _take(self, tool: Tool, result: object) -> bool:
        """Put a tool's result into the session; returns whether there was one."""
        before = self._session.document
        if result is None or before is None:
            return False
        if isinstance(result, Document):
            refuse_nonsense(before, result)
            if result is before:
                return False
            self._session.change(result, tool.label or tool.title)
            return True
        if isinstance(result, Step):
            self._makers[type(result)] = tool
            self._session.apply(result)
            return True
        raise NonsenseError(f"it returned {type(result).__name__}, not a document or a step")

    def _put_away(self) -> None:
        self._patience.end()
        self._canvas.clear_ink()
        self._unmark()
        self.said.emit("")
        self._session.end_preview()
        self.gesture_changed.emit()

    def _fail(self, tool: Tool | None, error: Exception) -> None:
        reason = f"{type(error).__name__}: {error}"
        if tool is None:
            self._session.problems.say(f"A tool failed and was stopped ({reason}).")
            return
        self._switch_off(tool, reason)

    def _misbehaved(self, step: Step, reason: str, wrong: bool) -> None:
        """A step was given up: its tool is named, and switched off when it did wrong."""
        tool = self._makers.get(type(step))
        if tool is None:
            self._session.problems.say(
                f"The step “{step.title}” {reason}. Your document is as it was."
            )
        elif wrong:
            self._switch_off(tool, f"its step {reason}")
        else:
            self._session.problems.say(
                f"The tool “{tool.title}” {reason} and was left behind. Your document is as it was."
            )

    def _switch_off(self, tool: Tool, reason: str) -> None:
        self.switched_off.add(tool.id)
        self.reasons[tool.id] = reason
        if self.active is tool:
            self._active = next(
                (name for name in self.tools if name not in self.switched_off), self._active
            )
            self._hand_over()
        self._session.problems.say(
            f"The tool “{tool.title}” failed and was stopped ({reason}). It is switched off until "
            "the next start, and your document is as it was; choose another tool."
        )
        self.tool_changed.emit()

    def switch_on(self, name: str) -> None:
        """Give a tool that was switched off another try."""
        self.switched_off.discard(name)
        self.reasons.pop(name, None)
        self.tool_changed.emit()

    def _asked(self, tool: Tool, question: str, about: object, otherwise: object) -> object:
        """Ask a tool about the document or its options; one that raises is switched off, named."""
        if tool.id in self.switched_off:
            return otherwise
        try:
            return getattr(tool, question)(about)
        except Exception as error:
            log.info("Tool %s raised in %s", tool.id, question, exc_info=True)
            self._fail(tool, error)
            return otherwise

    # ---- the Context that tools see

    @property
    def document(self) -> Document:
        """The document as it is now."""
        assert self._session.document is not None
        return self._session.document

    @property
    def options(self) -> Any:
        """The active tool's options."""
        return self._options[self._active]

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

    def pick(self, x: float, y: float) -> Hit | None:
        """What is visible at a pixel."""
        return self._canvas.pick(x, y)

    def vertices_inside(self, polygon: F64, through: bool = False) -> I64:
        """Ids of the vertices inside a closed lasso."""
        return self._canvas.vertices_inside(polygon, through)

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Ids of the vertices within `radius` px of a pixel."""
        return self._canvas.vertices_near(x, y, radius, through)

    def mark(self, ids: I64 | None) -> None:
        """Show `ids` as the region until the gesture ends."""
        self._marked = True
        self._canvas.set_region(ids)

    def faces_under(self, path: F64) -> I64:
        """Ids of the visible faces below a path."""
        return self._canvas.faces_under(path)

    def draw(self, path: F64, role: Role, closed: bool = False) -> None:
        """Show ink over the scene."""
        self._canvas.ink(path, role, closed)

    def preview(self, change: Document | Step) -> None:
        """Show what `change` would give."""
        tool = self.active
        if isinstance(change, Document):
            refuse_nonsense(self.document, change)
        elif not isinstance(change, Step):
            raise NonsenseError(f"it previews {type(change).__name__}, not a document or a step")
        elif tool is not None:
            self._makers[type(change)] = tool
        self._session.preview(change)

    def notice(self, text: str) -> None:
        """Put a sentence where the hint is for some seconds."""
        self._session.noticed.emit(text)

    def span(self, first: F64, last: F64, text: str) -> None:
        """Show a line between two points with words until the tool is put away."""
        self._canvas.show_curve(SPAN, np.array([first, last]), "guide", label=text)
        self._spanned = True

    def _unspan(self) -> None:
        if self._spanned:
            self._canvas.hide_curve(SPAN)
            self._spanned = False

    def say(self, text: str) -> None:
        """Put a sentence where the hint is."""
        self.said.emit(text)
