"""Free place: where something may lie over the viewport without covering the form."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtWidgets import QWidget

from engine.arrays import F64

MARGIN = 16
_DIRECT = Qt.FindChildOption.FindDirectChildrenOnly
AROUND = 8  # px that should stay free beside it


def free_place(
    room: QSize, sizes: Sequence[QSize], taken: Iterable[QRect], form: F64
) -> tuple[int, QPoint]:
    """Return which of `sizes` fits best, and the corner of the room that it fits in.

    The first size in the first corner that covers nothing is taken: upper left, lower left, lower
    right, upper right, or above what lies at the lower edge. Where every one covers something, it
    is the one that covers least.

    Parameters
    ----------
    room : of the viewport, px.
    sizes : that it may have, the best first.
    taken : what lies over the viewport already, px.
    form : (p, 2) points of the form as they are seen, px.
    """
    blocked = list(taken)
    best, least = (0, QPoint(MARGIN, MARGIN)), np.inf
    # Above what lies along the lower edge there is room as well.
    floor = min((one.top() for one in blocked if 2 * one.top() > room.height()), default=0)
    for which, size in enumerate(sizes):
        right = room.width() - size.width() - MARGIN
        low = room.height() - size.height() - MARGIN
        above = floor - size.height() - MARGIN
        corners = [(MARGIN, MARGIN), (MARGIN, low), (right, low), (right, MARGIN)]
        for x, y in (*corners, (MARGIN, above), (right, above)):
            if x < 0 or y < 0 or y + size.height() > room.height():
                continue
            found = covered(QRect(QPoint(x, y), size), blocked, form)
            if found < least:
                best, least = (which, QPoint(x, y)), found
            if found == 0:
                return best
    return best


def beside(widget: QWidget) -> list[QWidget]:
    """Return what else lies over the same viewport now, but for what covers all of it."""
    over = widget.parentWidget()
    if over is None:
        return []
    everything = over.rect()
    return [
        one
        for one in over.findChildren(QWidget, options=_DIRECT)
        if one is not widget and one.isVisible() and one.geometry() != everything
    ]


def covered(place: QRect, taken: Iterable[QRect], form: F64) -> float:
    """Return how much of the form, and above all of what lies there already, a place covers."""
    wide = place.adjusted(-AROUND, -AROUND, AROUND, AROUND)
    return _inside(wide, form) + 1e6 * sum(wide.intersects(one) for one in taken)


def _inside(place: QRect, points: F64) -> int:
    """Return how many points (p, 2) lie in a rectangle."""
    low = np.array([place.left(), place.top()])
    high = np.array([place.right(), place.bottom()])
    return int(((points >= low) & (points <= high)).all(axis=1).sum())
