"""Key hand: a cross over the form that arrow keys move and Space sets to the form, like a pen.

Whatever a tool does by hand it does by keys too: it gets the same pointer events. Where a tool
draws a curve, Space sets points on its way, and Enter ends it; where it takes hold or paints, it
follows the cross from one Space to the next.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QObject, Qt, Signal

from app.draw_examples import through_points
from app.toolhost import ToolHost
from app.viewport import Viewport
from engine.arrays import F64
from plugins.api import Pointer, Role

STEP = 12.0  # px that the cross goes at a press of an arrow key
FINE_STEP = 2.0  # the same with Shift
MARGIN = 2.0  # px that it keeps from the edge of the picture
CLOSES = 1.5 * STEP  # px: a curve that ends so near to where it began ends there
WAY = 4.0  # px between two places on the way of a drag

_Key = Qt.Key
_ARROWS = {
    _Key.Key_Left: (-1, 0),
    _Key.Key_Right: (1, 0),
    _Key.Key_Up: (0, -1),
    _Key.Key_Down: (0, 1),
}
_TAKES_OVER = (QEvent.Type.MouseButtonPress, QEvent.Type.TabletPress, QEvent.Type.TouchBegin)


class KeyHand(QObject):
    """Draws by keys while it is switched on.

    Attributes
    ----------
    on : whether the arrow keys move the cross, not the view.
    at : (x, y) where the cross is, logical px.
    points : those of the curve that is being drawn, px.

    Signals
    -------
    changed : it was switched on or off, or does something else now.
    """

    changed = Signal()

    def __init__(self, viewport: Viewport, host: ToolHost, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._viewport = viewport
        self._host = host
        self.on = False
        self.at: tuple[float, float] | None = None
        self.points: list[tuple[float, float]] = []
        self._first: Pointer | None = None  # the press that began the gesture
        self._role: Role | None = None  # of the curve it draws; None where it takes hold
        self._held: set[Qt.Key] = set()
        viewport.installEventFilter(self)
        host.gesture_changed.connect(self._gesture_changed)
        host.tool_changed.connect(self._hover)

    @property
    def down(self) -> bool:
        """Whether a curve or a drag is under way."""
        return self._first is not None

    def switch(self) -> None:
        """Take the keys for drawing, or give them back to the view."""
        self.on = not self.on
        if self.on:
            self._viewport.setFocus()
            self.at = self._within(*(self.at or self._middle()))
            self._hover()
        else:
            self._drop()
        self._show()
        self.changed.emit()

    def words(self) -> str:
        """What the keys do now, for the hint line; "" while it is off."""
        if not self.on:
            return ""
        if self.down and self._role is not None:
            return "Space sets the next point, {edit.apply} ends the curve at the cross"
        if self.down:
            return "Arrow keys drag, Space lets go"
        begins = "sets the first point" if self._drawn() is not None else "presses"
        return f"Arrow keys move the cross, Space {begins}"

    # ---- keys

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the keys that are ours; whoever takes mouse or pen in hand needs them no more."""
        if not self.on:
            return False
        kind = event.type()
        if kind in _TAKES_OVER:
            self.switch()
            return False
        take = {
            QEvent.Type.KeyPress: self._key_press,
            QEvent.Type.KeyRelease: self._key_release,
        }.get(kind)
        return take is not None and take(event)

    def _key_press(self, event: Any) -> bool:
        key, modifiers = event.key(), event.modifiers()
        if key in _ARROWS:
            if modifiers & (Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.ControlModifier):
                return self.down  # they turn and zoom, but not below a hand that draws
            self._held.add(key)
            fine = modifiers & Qt.KeyboardModifier.ShiftModifier
            self._move(FINE_STEP if fine else STEP)
        elif key == _Key.Key_Space:
            if not event.isAutoRepeat():
                self._space(modifiers)
        else:
            return False
        return True

    def _key_release(self, event: Any) -> bool:
        if not event.isAutoRepeat():
            self._held.discard(event.key())
        return event.key() == _Key.Key_Space

    def _move(self, step: float) -> None:
        """Move the cross by the arrows that are held: two of them go aslant."""
        x, y = self.at or self._middle()
        dx = sum(_ARROWS[key][0] for key in self._held)
        dy = sum(_ARROWS[key][1] for key in self._held)
        before, self.at = (x, y), self._within(x + step * dx, y + step * dy)
        if self._first is None:
            self._hover()
        elif self._role is None:
            self._drag(before, self.at)
        self._show()

    def _space(self, modifiers: Qt.KeyboardModifier) -> None:
        """Begin; or set the next point, or let go."""
        assert self.at is not None
        if not self.down:
            self._begin(modifiers)
        elif self._role is None:
            self.end()
        elif self.at != self.points[-1]:
            self.points.append(self.at)
            self._show()

    # ---- what a hand does

    def _begin(self, modifiers: Qt.KeyboardModifier) -> None:
        assert self.at is not None
        role, mods = self._drawn(), Qt.KeyboardModifier
        first = Pointer(
            "press",
            *self.at,
            shift=bool(modifiers & mods.ShiftModifier),
            ctrl=bool(modifiers & mods.ControlModifier),
            time=time.monotonic(),
        )
        self._viewport.emit_pointer(first)
        if not self._host.in_gesture:
            return  # the tool has said why
        self._first, self._role, self.points = first, role, [self.at]
        self._show()
        self.changed.emit()

    def end(self) -> None:
        """Let the tool have the curve, or let go of what it holds."""
        assert self.at is not None
        if self._role is not None:
            path = self._path()
            self._viewport.clear_ink()
            for place in path[1:]:
                self._send("move", (float(place[0]), float(place[1])))
            end = (float(path[-1, 0]), float(path[-1, 1]))
        else:
            end = self.at
        first, self._first = self._first, None
        self.points = []
        self._show()
        self._send("release", end, first)
        self.changed.emit()

    def _drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Move what is held; on the way it is seen at places as near as a hand's."""
        count = max(1, int(np.ceil(np.hypot(end[0] - start[0], end[1] - start[1]) / WAY)))
        for k in range(1, count + 1):
            share = k / count
            x = start[0] + share * (end[0] - start[0])
            self._send("move", (x, start[1] + share * (end[1] - start[1])))

    def _send(self, kind: Any, at: tuple[float, float], first: Pointer | None = None) -> None:
        first = first or self._first
        if first is not None:
            pointer = replace(first, kind=kind, x=at[0], y=at[1], time=time.monotonic())
            self._viewport.emit_pointer(pointer)

    def _hover(self) -> None:
        """Show what the tool would take here."""
        if self.on and self.at is not None and not self.down:
            self._viewport.emit_pointer(Pointer("hover", *self.at))

    def _gesture_changed(self) -> None:
        if self.down and not self._host.in_gesture:
            self._drop()
            self.changed.emit()

    def _drop(self) -> None:
        """Give up what is under way."""
        was_down, self._first = self.down, None
        self.points = []
        self._held.clear()
        if was_down:
            self._viewport.clear_ink()
            self._host.cancel()
        self._show()

    # ---- what is seen

    def _path(self) -> F64:
        """Return the smooth curve through the points and the cross, (p, 2) px."""
        assert self.at is not None
        points = [*self.points] if self.at == self.points[-1] else [*self.points, self.at]
        if len(points) == 1:
            return np.array([*points, *points])
        near = np.hypot(*np.subtract(points[0], points[-1])) <= CLOSES
        closed = len(points) > 2 and (self._role == "region" or bool(near))
        if closed and near:
            points = points[:-1]
        if len(points) == 2:
            return through_points(points)
        return through_points(points, closed)

    def _show(self) -> None:
        self._viewport.overlay.set_cross(self.at if self.on else None, tuple(self.points))
        if self.down and self._role is not None:
            self._viewport.ink(self._path(), self._role, closed=self._role == "region")

    def _drawn(self) -> Role | None:
        """Role of the curve that the tool in hand would draw, or None."""
        return self._host.draws()

    def _middle(self) -> tuple[float, float]:
        return (self._viewport.width() / 2, self._viewport.height() / 2)

    def _within(self, x: float, y: float) -> tuple[float, float]:
        """Return the place nearest to (x, y) that is in the picture."""
        wide, high = self._viewport.width(), self._viewport.height()
        return (
            min(max(x, MARGIN), max(MARGIN, wide - MARGIN)),
            min(max(y, MARGIN), max(MARGIN, high - MARGIN)),
        )
