"""Region by wheel: Shift and the wheel grow the region, or shrink it, seen at every notch."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject, QTimer

from app.session import Session
from app.viewport import Viewport
from engine.arrays import I64
from engine.selection import grown, shrunk
from plugins.api import Pointer

RESTS_MS = 350  # after the last notch
SHARE = 1 / 40  # rings in a notch, beside the square root of the region's size


class RegionWheel(QObject):
    """Counts notches, shows what they make of the region, and takes it when the wheel rests.

    One turn of the wheel is one change, however many notches it has; back and forth is exact.
    """

    def __init__(self, session: Session, viewport: Viewport, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._viewport = viewport
        self._begun: I64 | None = None  # the region that the wheel found
        self._made: I64 | None = None
        self._notches = 0.0
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(RESTS_MS)
        self._rest.timeout.connect(self.take)
        viewport.shift_scrolled.connect(self._turn)
        viewport.pointer.connect(self._pointed)
        session.document_changed.connect(self._forget)

    def _turn(self, notches: float) -> None:
        document = self._session.document
        if document is None or document.draft.roi is None or self._session.applying:
            return
        if self._begun is None:
            self._begun, self._notches = document.draft.roi, 0.0
        before, topology = self._notches, document.mesh.topology
        self._notches += notches
        # Each notch as wide for the eye, however fine the mesh is.
        rings = int(self._notches * max(1.0, SHARE * np.sqrt(len(self._begun))))
        made = grown(topology, self._begun, rings) if rings > 0 else self._begun
        if rings < 0:
            made = shrunk(topology, self._begun, -rings)
        if len(made) == 0 or (len(made) == document.mesh.n and len(self._begun) < len(made)):
            self._notches = before  # nothing would be left of it, or nothing of its rim
        else:
            self._made = made
            self._viewport.set_region(made)
        self._rest.start()

    def take(self) -> None:
        """Make what is seen the region."""
        begun, made = self._begun, self._made
        self._forget()
        if begun is not None and made is not None and not np.array_equal(begun, made):
            label = "Region grown" if len(made) > len(begun) else "Region shrunk"
            self._session.choose_region(made, label, curves_stay=True)

    def stop(self) -> None:
        """Forget what was not taken, for closing."""
        self._forget()

    def _pointed(self, pointer: Pointer) -> None:
        if pointer.kind == "press":
            self.take()  # what is drawn next is drawn on what is seen

    def _forget(self) -> None:
        self._rest.stop()
        self._begun = self._made = None
