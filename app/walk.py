"""Walk: F6 takes the keys from one part of the window to the next, as Tab does inside a part."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QWidget

if TYPE_CHECKING:
    from app.window import Window


def parts(window: Window) -> list[QWidget]:
    """Return the parts that can take the keys now, in the order they are walked."""
    panels = (window.level, window.edit, window.steps)
    morph = () if window.compare is None else (window.compare.morph,)
    bars = (window.strip, window.stripes_bar, window.trace_bar)
    every = (window.viewport, window.rail, *bars, *morph, *panels)
    return [part for part in every if part.isVisible() and entrance(part) is not None]


def entrance(part: QWidget) -> QWidget | None:
    """Return the first widget of a part that takes the keys, or None."""
    if part.focusPolicy() & Qt.FocusPolicy.TabFocus:
        return part
    inside = part.nextInFocusChain()
    while inside is not None and inside is not part:
        takes = inside.focusPolicy() & Qt.FocusPolicy.TabFocus
        if takes and part.isAncestorOf(inside) and inside.isVisible() and inside.isEnabled():
            return inside
        inside = inside.nextInFocusChain()
    return None


def walk(window: Window, by: int) -> None:
    """Give the keys to the part `by` places on from the one that has them."""
    every, held = parts(window), QApplication.focusWidget()
    holds = (k for k, one in enumerate(every) if held and (one is held or one.isAncestorOf(held)))
    here = next(holds, -by)
    wanted = entrance(every[(here + by) % len(every)])
    assert wanted is not None
    wanted.setFocus(Qt.FocusReason.TabFocusReason)
