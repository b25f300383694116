"""Finds tools and steps through entry points; what failed to load is listed with the reason.

Built-in tools and steps are found in the same way as a third party's: by the entry-point groups
`eigenform.tools` and `eigenform.steps` of installed distributions. Single files that a person
switched on (see `plugins.dropin`) come after them.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import Distribution, EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from engine import Kinds, Step
from plugins.api import Tool
from plugins.dropin import DropInPoint, dropin_points
from plugins.importing import imported

log = logging.getLogger(__name__)

TOOLS = "eigenform.tools"
STEPS = "eigenform.steps"
OURS = "eigenform"
STEP_NAMES = ("apply", "to_json", "from_json", "title")

T = TypeVar("T")
Points = Iterable[EntryPoint | DropInPoint]


@dataclass(frozen=True)
class Failure:
    """A plugin that could not be used: its group and name, who offers it, and why not."""

    group: str
    name: str
    distribution: str
    reason: str

    def __str__(self) -> str:
        kind = "tool" if self.group == TOOLS else "step"
        return f"The {kind} “{self.name}” of {self.distribution} was left out: {self.reason}"


@dataclass(frozen=True)
class Found(Generic[T]):
    """What was found in a group: name to item, in the order of use, and what failed."""

    items: dict[str, T]
    failures: tuple[Failure, ...]


def find_tools(points: Points | None = None) -> Found[Tool]:
    """Return one instance of every tool that could be loaded, in the order of the tool rail.

    Parameters
    ----------
    points : entry points to look at; None for those of all installed distributions.
    """
    found = _load(TOOLS, points, _tool)
    ordered = sorted(found.items.items(), key=lambda item: (item[1].order, item[0]))
    return Found(dict(ordered), found.failures)


def find_steps(points: Points | None = None) -> Found[type[Step]]:
    """Return every kind of step that could be loaded."""
    return _load(STEPS, points, _step)


def kinds() -> Kinds:
    """Return the kinds of steps that recipes can hold, name to class."""
    return find_steps().items


def origins(group: str) -> dict[str, str]:
    """Return who offers each tool or step of a group: a distribution or a file."""
    return {point.name: _origin(point) for point in reversed(_all_points(group))}


def _load(group: str, points: Points | None, check: Callable[[str, Any], T]) -> Found[T]:
    items: dict[str, T] = {}
    failures: list[Failure] = []
    for point in _all_points(group) if points is None else points:
        distribution = _origin(point)
        try:
            if point.name in items:
                raise TypeError(f"another plugin already offers the name “{point.name}”")
            items[point.name] = _loaded(point, check)
        except Exception as error:  # whatever a stranger's module does on import
            log.info("Plugin %s (%s) was left out", point.name, distribution, exc_info=True)
            reason = f"{type(error).__name__}: {error}"
            failures.append(Failure(group, point.name, distribution, reason))
    return Found(items, tuple(failures))


def _loaded(point: EntryPoint | DropInPoint, check: Callable[[str, Any], T]) -> T:
    def load() -> T:
        return check(point.name, point.load())

    return load() if _origin(point) == OURS else imported(point, load)


def _all_points(group: str) -> list[EntryPoint | DropInPoint]:
    tools, steps = dropin_points()
    return [*_installed(group), *(tools if group == TOOLS else steps)]


@cache
def _installed(group: str) -> tuple[EntryPoint, ...]:
    """Entry points of installed distributions: read once, since every reading takes 50 ms."""
    return tuple(entry_points(group=group))


@cache
def _name_of(distribution: Distribution) -> str:
    return distribution.name


def _origin(point: EntryPoint | DropInPoint) -> str:
    if isinstance(point, DropInPoint):
        return point.origin
    return _name_of(point.dist) if point.dist is not None else "an unknown distribution"


def _tool(name: str, offered: Any) -> Tool:
    if not (isinstance(offered, type) and issubclass(offered, Tool)):
        raise TypeError("it is not a subclass of plugins.api.Tool")
    for attribute in ("id", "title"):
        if not isinstance(getattr(offered, attribute, None), str):
            raise TypeError(f"it has no text “{attribute}”")
    if offered.id != name:
        raise TypeError(f"its id is “{offered.id}”, but its entry point is called “{name}”")
    if not dataclasses.is_dataclass(offered.Options):
        raise TypeError("its Options are not a dataclass")
    offered.Options()
    return offered()


def _step(name: str, offered: Any) -> type[Step]:
    missing = [one for one in STEP_NAMES if not hasattr(offered, one)]
    if not isinstance(offered, type) or missing:
        raise TypeError(f"it is not a step class: {', '.join(missing) or 'no class'} missing")
    if getattr(offered, "kind", None) != name:
        raise TypeError(
            f"its kind is {getattr(offered, 'kind', None)!r}, but its entry point is “{name}”"
        )
    return offered
