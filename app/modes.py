"""Modes viewer: the shape of one mode on the form (Fig. 5), coloured, and swinging if wanted."""

from __future__ import annotations

import math
import time

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from app.session import Session
from app.stage import Stage
from app.viewport import Viewport
from app.viewport.shading import mapped
from engine.arrays import F64

FRAME_MS = 33
PERIOD = 1.6  # seconds of one swing
REACH = 0.05  # of the region's diagonal, to begin with


class ModesViewer(QObject):
    """Shows a mode instead of the form at its level; anything else the person does ends it.

    Signals
    -------
    changed : another mode is shown, or none.
    """

    changed = Signal()

    def __init__(self, session: Session, stage: Stage, viewport: Viewport) -> None:
        super().__init__(viewport)
        self._session = session
        self._stage = stage
        self._viewport = viewport
        self.mode: int | None = None
        self._ids = np.zeros(0, dtype=np.int64)
        self._rest: F64 = np.zeros((0, 3))
        self._shape: F64 = np.zeros((0, 3))
        self.reach = REACH
        self._began = 0.0
        self._clock = QTimer(self)
        self._clock.setInterval(FRAME_MS)
        self._clock.timeout.connect(self._frame)
        session.document_changed.connect(self.hide)

    @property
    def playing(self) -> bool:
        """Whether the mode swings."""
        return self._clock.isActive()

    def show(self, mode: int, playing: bool = False) -> None:
        """Show mode number `mode`, counted from 1, on the base shape."""
        known, document = self._session.decomposition, self._session.document
        if known is None or document is None or known.k == 0:
            return
        mode = min(max(mode, 1), known.k)
        phi = np.asarray(known.modes[:, mode - 1])
        phi = phi / np.abs(phi).max()
        base = document.mesh.vertices.copy()
        base[known.roi] = known.base
        normals = document.mesh.with_vertices(base).vertex_normals[known.roi]
        size = float(np.linalg.norm(np.ptp(known.base, axis=0)))
        self._ids, self._rest = known.roi, known.base
        self._shape = size * phi[:, None] * normals
        values = np.zeros(document.mesh.n)
        values[known.roi] = phi
        if self.mode is None:
            self._stage.pause(True)
        self.mode = mode
        self._viewport.set_colours(mapped(values, 1.0))
        self._began = time.monotonic()
        self._put(0.0 if playing else 1.0)
        if playing:
            self._clock.start()
        else:
            self._clock.stop()
        self.changed.emit()

    def set_reach(self, reach: float) -> None:
        """Let modes swing so far: a share of the region's diagonal."""
        self.reach = reach
        if self.mode is not None and not self.playing:
            self._put(1.0)

    def hide(self) -> None:
        """Show the form again."""
        self._clock.stop()
        if self.mode is None:
            return
        self.mode = None
        self._viewport.set_display(self._viewport.display)
        self._stage.pause(False)
        self.changed.emit()

    def stop(self) -> None:
        """End what moves by itself, for closing."""
        self._clock.stop()

    def _frame(self) -> None:
        self._put(math.sin(2 * math.pi * (time.monotonic() - self._began) / PERIOD))

    def _put(self, share: float) -> None:
        self._viewport.set_vertices(self._rest + share * self.reach * self._shape, self._ids)
