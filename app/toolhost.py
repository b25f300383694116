"""Tool host: the tool in hand, its gesture, and what becomes of what it returns.

A tool is a stranger: it may raise, hang, return nonsense or change what it must not. Then its
gesture is closed, the person is told its name, and the document stays as it was.
"""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from app.circle_size import CircleSize
from app.drawing_surface import DrawingSurface
from app.nonsense import NonsenseError, refuse_nonsense
from app.session import Session
from app.toolbox import Toolbox, ToolFailedError
from app.toolcontext import ToolContext
from engine import Cancelled, Document, EngineError, Step
from plugins.api import Gesture, Pointer, Role, Tool


class ToolHost(QObject):
    """Feeds pointer events to the active tool's generator, and hands over to the next tool.

    Attributes
    ----------
    toolbox : the tools there are.
    context : what the active tool sees.
    circle : the size of the active tool's circle.

    Signals
    -------
    tool_changed : another tool is active, or its options are others.
    gesture_changed : a gesture began or ended.
    """

    tool_changed = Signal()
    gesture_changed = Signal()

    def __init__(
        self,
        session: Session,
        canvas: DrawingSurface,
        toolbox: Toolbox,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.toolbox = toolbox
        self.context = ToolContext(session, canvas, toolbox, self)
        self._session = session
        self._canvas = canvas
        self._gesture: Gesture | None = None
        self._pressed = False
        self.circle = CircleSize(toolbox, lambda: self.active, self._show_circle)
        self.context.tool = next(iter(toolbox.tools.values()), None)
        toolbox.options_changed.connect(self._set_otherwise)
        toolbox.tool_switched_off.connect(self._switched_off)
        toolbox.tool_switched_on.connect(self.tool_changed)
        session.opened.connect(self._opened)
        session.document_changed.connect(self._follow)
        session.misbehaved.connect(self._misbehaved)

    # ---- which tool

    @property
    def unit(self) -> str:
        """What one unit of the model is."""
        document = self._session.document
        return "mm" if document is None else document.unit

    @property
    def active(self) -> Tool | None:
        """The tool in hand."""
        return self.context.tool

    @property
    def in_gesture(self) -> bool:
        """Whether a gesture is under way."""
        return self._gesture is not None

    def choose(self, name: str) -> None:
        """Take another tool in hand."""
        if name not in self.toolbox.tools or name in self.toolbox.reasons:
            return
        self.cancel()
        self.context.unspan()
        self.context.tool = self.toolbox.tools[name]
        self._canvas.brush(0.0, 0.0, None)  # the next move of the hand shows what it takes now
        self._session.problems.clear()
        self._session.told.emit("")  # so is what was said about the last stroke
        self._show_live()
        self.tool_changed.emit()

    def available(self, name: str) -> bool:
        """Whether a tool can be used on the document now."""
        document = self._session.document
        return document is not None and self.toolbox.available(self.toolbox.tools[name], document)

    def hint(self) -> str:
        """What the active tool says about the document."""
        document, tool = self._session.document, self.active
        return "" if document is None or tool is None else self.toolbox.hint(tool, document)

    def draws(self) -> Role | None:
        """Role of the curve that the active tool would draw now; None where it takes hold."""
        document, tool = self._session.document, self.active
        return None if document is None or tool is None else self.toolbox.draws(tool, document)

    def _opened(self) -> None:
        self.cancel()
        document = self._session.document
        if document is not None:
            self.toolbox.fit(document.mesh.diagonal)
        self._hand_over()

    def _follow(self) -> None:
        # The document went on beneath a gesture (undo by a key, a late refusal): the gesture works
        # on what is no more, and another tool may take over now.
        self.cancel()
        tool = self.active
        if tool is None or not tool.repeats or not self.available(tool.id):
            self._hand_over()
        elif tool.live and not self._session.rests_on_details:
            self._show_live()
        self.tool_changed.emit()

    def _hand_over(self) -> None:
        """The flow goes on with the first tool that claims the document."""
        document = self._session.document
        if document is None:
            return
        for tool in self.toolbox.tools.values():
            if self.toolbox.claims(tool, document):
                self.context.tool = tool
                break
        self.tool_changed.emit()

    def _set_otherwise(self) -> None:
        self._show_live()
        self.tool_changed.emit()

    def _show_live(self) -> None:
        """Preview what Enter would do, for a tool that is set by its options alone."""
        tool = self.active
        if tool is None or not tool.live or not self.available(tool.id):
            self._session.end_preview()
            return

        def look(result: object) -> None:
            if isinstance(result, Document | Step):
                self.context.preview(result)
            else:
                self._session.end_preview()  # there is nothing to apply

        self._enter(tool, look)

    # ---- gestures

    def pointer(self, event: Pointer) -> None:
        """Take one event of mouse or pen."""
        if self.circle.takes(event, free=self._gesture is None):
            return
        self._show_circle(event)
        self._pressed = event.kind == "press" or (self._pressed and event.kind == "move")
        if event.kind == "press" and self._gesture is None:
            self._begin(event)
        elif self._gesture is not None and event.kind != "hover":
            self._advance(event)

    def _show_circle(self, event: Pointer) -> None:
        tool = self.active
        if tool is not None and self._session.document is not None:
            self._canvas.brush(event.x, event.y, self.toolbox.circle(tool))

    def cancel(self) -> bool:
        """Close the gesture under way; returns whether there was one."""
        tool, gesture = self.active, self._gesture
        if gesture is None or tool is None:
            return False
        self._gesture = None
        try:
            with self.toolbox.calling(tool):
                gesture.close()
        except (ToolFailedError, EngineError) as error:
            self.toolbox.blame(tool, error)
        self._put_away()
        return True

    def enter(self) -> None:
        """Do what Enter asks for: the active tool decides, by default it applies the draft."""
        tool = self.active
        if self._gesture is not None and tool is not None and tool.waits and not self._pressed:
            self._advance(Pointer("enter", 0.0, 0.0))
        elif self._gesture is None and self._session.document is not None and tool is not None:
            self._enter(tool, lambda result: self._take(tool, result))

    def can_enter(self) -> bool:
        """Whether Enter has something to do: strokes to apply, or a tool with its own answer."""
        document, tool = self._session.document, self.active
        if document is None or tool is None or self._session.applying:
            return False
        if self._gesture is not None and tool.waits:
            return True
        own = type(tool).enter is not Tool.enter
        return document.draft.edit() is not None or (own and self.available(tool.id))

    def _enter(self, tool: Tool, use: Callable[[object], object]) -> None:
        """Use what a tool answers to Enter."""
        try:
            with self.toolbox.calling(tool):
                result = tool.enter(self.context)
            use(result)
        except EngineError as error:
            self._session.problems.report(error)
        except ToolFailedError as error:
            self.toolbox.blame(tool, error)

    def _begin(self, event: Pointer) -> None:
        tool = self.active
        if tool is None or self._session.document is None or self._session.applying:
            return
        self._session.problems.clear()
        try:
            with self.toolbox.calling(tool):
                gesture = tool.gesture(self.context, event)
            if not hasattr(gesture, "send"):
                raise NonsenseError("its gesture is not a generator")
        except EngineError as error:
            self._session.problems.report(error)
            return
        except ToolFailedError as error:
            self.toolbox.blame(tool, error)
            return
        self._gesture = gesture
        self.gesture_changed.emit()
        self._advance(None)

    def _advance(self, event: Pointer | None) -> None:
        tool, gesture = self.active, self._gesture
        assert tool is not None
        assert gesture is not None
        try:
            with self.toolbox.calling(tool):
                ended, result = _sent(gesture, event)
        except EngineError as error:
            self._gesture = None
            self._put_away()
            if not isinstance(error, Cancelled):
                self._session.problems.report(error)
        except ToolFailedError as error:
            self._gesture = None
            self._put_away()
            self.toolbox.blame(tool, error)
        else:
            if ended:
                self._gesture = None
                self._finish(tool, result)

    def _finish(self, tool: Tool, result: object) -> None:
        self.context.end_gesture()
        try:
            taken = self._take(tool, result)
        except NonsenseError as error:
            self.toolbox.blame(tool, error)
            taken = False
        self.context.unmark()
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
            self.toolbox.note_step(result, tool)
            self._session.apply(result)
            return True
        raise NonsenseError(f"it returned {type(result).__name__}, not a document or a step")

    def _put_away(self) -> None:
        self.context.end_gesture()
        self.context.unmark()
        self._session.end_preview()
        self.gesture_changed.emit()

    # ---- tools that do wrong

    def _misbehaved(self, step: Step, reason: str, wrong: bool) -> None:
        """A step was given up: its tool is named, and switched off when it did wrong."""
        tool = self.toolbox.maker_of(step)
        safe = "Your document is as it was."
        if tool is None:
            self._session.problems.say(f"The step “{step.title}” {reason}. {safe}")
        elif wrong:
            self.toolbox.switch_off(tool, f"its step {reason}")
        else:
            words = f"The tool “{tool.title}” {reason} and was left behind. {safe}"
            self._session.problems.say(words)

    def _switched_off(self, tool: Tool) -> None:
        if self.active is tool:
            others = (
                one for one in self.toolbox.tools.values() if one.id not in self.toolbox.reasons
            )
            self.context.tool = next(others, tool)
            self._hand_over()
        reason = self.toolbox.reasons[tool.id]
        self._session.problems.say(
            f"The tool “{tool.title}” failed and was stopped ({reason}). It is switched off until "
            "the next start, and your document is as it was; choose another tool."
        )
        self.tool_changed.emit()


def _sent(gesture: Gesture, event: Pointer | None) -> tuple[bool, object]:
    """Send an event to a gesture, or start it; returns whether it ended, and what it returned."""
    try:
        if event is None:
            next(gesture)
        else:
            gesture.send(event)
    except StopIteration as end:
        return True, end.value
    return False, None
