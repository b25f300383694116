"""Toolbox: the tools there are, how they are set, and which of them are switched off.

A tool is a stranger: it may raise, hang or answer nonsense when it is only asked. Then it is
switched off, with the reason, and the answer is the one that does no harm.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any, TypeVar, get_args

from PySide6.QtCore import QObject, Signal

from app.patience import Patience
from engine import Document, EngineError, Step
from plugins.api import Role, Tool

log = logging.getLogger(__name__)

T = TypeVar("T")


class ToolFailedError(Exception):
    """A tool did what no tool may do; the words say what."""


class Toolbox(QObject):
    """Holds one instance of every tool, and asks them what they are always asked.

    Attributes
    ----------
    tools : by their ids, in the order of the tool rail.
    reasons : why a tool is switched off, by its id.

    Signals
    -------
    options_changed : a tool has other options.
    tool_switched_off(tool) : a tool did wrong; its reason is in `reasons`.
    tool_switched_on : a tool gets another try.
    """

    options_changed = Signal()
    tool_switched_off = Signal(object)
    tool_switched_on = Signal()

    def __init__(self, tools: Mapping[str, Tool], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.tools = dict(tools)
        self.reasons: dict[str, str] = {}
        self._patience = Patience()
        self._options: dict[str, Any] = {name: tool.Options() for name, tool in tools.items()}
        self._makers: dict[type, Tool] = {}

    # ---- how they are set

    def options_of(self, name: str) -> Any:
        """The options of a tool as the person set them."""
        return self._options[name]

    def set_options(self, name: str, options: Any) -> None:
        """Give a tool other options."""
        self._options[name] = options
        self.options_changed.emit()

    def fit(self, diagonal: float) -> None:
        """Begin with lengths that suit a model of that diagonal, mesh units: 2 where it is 270."""
        for name, options in self._options.items():
            shares = {
                one.name: one.metadata["of_size"]
                for one in fields(options)
                if "of_size" in one.metadata
            }
            if shares:
                lengths = {key: float(f"{share * diagonal:.1g}") for key, share in shares.items()}
                self.set_options(name, replace(options, **lengths))

    # ---- what they are asked

    def available(self, tool: Tool, document: Document) -> bool:
        """Whether a tool can be used on a document."""
        return self._ask(tool, lambda: bool(tool.available(document)), False)

    def claims(self, tool: Tool, document: Document) -> bool:
        """Whether a tool is the natural next one for a document."""
        return self._ask(tool, lambda: bool(tool.claims(document)), False)

    def hint(self, tool: Tool, document: Document) -> str:
        """What a tool says to do next with a document."""
        return self._ask(tool, lambda: str(tool.hint(document)), tool.tip)

    def circle(self, tool: Tool) -> float | None:
        """Radius in px of the circle that a tool wants around the pointer, or None for none."""
        options = self._options[tool.id]
        return self._ask(tool, lambda: _radius(tool.circle(options)), None)

    def draws(self, tool: Tool, document: Document) -> Role | None:
        """Role of the curve that a tool would draw on a document, or None."""
        roles = get_args(Role)
        role = self._ask(tool, lambda: tool.draws(document), None)
        return role if role in roles else None

    def _ask(self, tool: Tool, question: Callable[[], T], otherwise: T) -> T:
        if tool.id in self.reasons:
            return otherwise
        try:
            with self.calling(tool):
                return question()
        except (ToolFailedError, EngineError) as error:
            self.blame(tool, error)
            return otherwise

    @contextmanager
    def calling(self, tool: Tool) -> Iterator[None]:
        """A call into a tool, within reasonable time.

        Raises
        ------
        ToolFailedError
            Something came out of it, or nothing for too long. An `EngineError` passes through: it
            is a sentence for the person.
        """
        try:
            with self._patience.call():
                yield
        except EngineError:
            raise
        except (Exception, SystemExit) as error:
            # A script that was made a tool may still call sys.exit.
            log.info("Tool %s raised", tool.id, exc_info=True)
            raise ToolFailedError(f"{type(error).__name__}: {error}") from error

    def stop(self) -> None:
        """Watch no calls any more, for closing."""
        self._patience.stop()

    # ---- which of them do wrong

    @property
    def switched_off(self) -> set[str]:
        """Ids of the tools that are switched off."""
        return set(self.reasons)

    def blame(self, tool: Tool, error: Exception) -> None:
        """Switch a tool off for what came out of it."""
        self.switch_off(tool, str(error))

    def switch_off(self, tool: Tool, reason: str) -> None:
        """Use a tool no more until it is switched on again."""
        self.reasons[tool.id] = reason
        self.tool_switched_off.emit(tool)

    def switch_on(self, name: str) -> None:
        """Give a tool that was switched off another try."""
        self.reasons.pop(name, None)
        self.tool_switched_on.emit()

    # ---- whose steps are whose

    def note_step(self, step: Step, tool: Tool) -> None:
        """Note that a step came from a tool."""
        self._makers[type(step)] = tool

    def maker_of(self, step: Step) -> Tool | None:
        """The tool that a step came from, if it came from one."""
        return self._makers.get(type(step))


def _radius(answer: object) -> float | None:
    if isinstance(answer, int | float) and math.isfinite(answer) and answer > 0:
        return float(answer)
    return None
