"""Circle size: the circle of the tool in hand is made larger or smaller, by keys or by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

from app.toolbox import Toolbox
from plugins.api import Pointer, Tool

STEP = 1.25  # from one size to the next, by keys


class CircleSize:
    """Changes the option that a tool names in `sized`.

    Parameters
    ----------
    active : gives the tool in hand.
    show : draws its circle where a pointer is.
    """

    def __init__(
        self, toolbox: Toolbox, active: Callable[[], Tool | None], show: Callable[[Pointer], None]
    ) -> None:
        self._toolbox = toolbox
        self._active = active
        self._show = show
        self._at: Pointer | None = None
        self._begun: tuple[Pointer, float] | None = None

    @property
    def possible(self) -> bool:
        """Whether the tool in hand has a circle that can be resized."""
        return self._radius() is not None

    def step(self, by: int) -> None:
        """Make it so many steps larger, or smaller, where it was seen last."""
        radius = self._radius()
        if radius is None:
            return
        # At least a pixel: a small circle would be rounded to where it was.
        self._set(radius + by * max(1.0, radius * (STEP - 1)))
        if self._at is not None:
            self._show(self._at)

    def takes(self, event: Pointer, free: bool) -> bool:
        """Whether an event belongs to a drag with Alt, which makes the circle larger sideways.

        Parameters
        ----------
        free : whether no gesture of the tool is under way.
        """
        self._at = event
        if event.kind == "press":
            radius = self._radius() if event.alt and free else None
            self._begun = None if radius is None else (event, radius)
        if self._begun is None:
            return False
        start, radius = self._begun
        self._set(radius + event.x - start.x)
        self._show(start)
        self._at = start
        if event.kind == "release":
            self._begun = None
        return True

    def _radius(self) -> float | None:
        tool = self._active()
        if tool is None or not tool.sized:
            return None
        value = getattr(self._toolbox.options_of(tool.id), tool.sized, None)
        return float(value) if isinstance(value, int | float) else None

    def _set(self, radius: float) -> None:
        tool = self._active()
        assert tool is not None
        options = self._toolbox.options_of(tool.id)
        limits = next(one.metadata for one in fields(options) if one.name == tool.sized)
        within = min(max(round(radius), limits.get("min", 1)), limits.get("max", 1000))
        if within != getattr(options, tool.sized):
            self._toolbox.set_options(tool.id, replace(options, **{tool.sized: float(within)}))
