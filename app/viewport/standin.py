"""A lighter form to show while a heavy one turns: its vertices clustered on a grid."""

from __future__ import annotations

import numpy as np

from app.viewport.surface import Surface
from engine.arrays import I64

CELLS_ACROSS = 128


def clustered(positions: np.ndarray, faces: I64, cells: int = CELLS_ACROSS) -> tuple[I64, I64]:
    """Return one vertex id per occupied grid cell (c,) and the faces between them (g, 3).

    Rossignac and Borrel's vertex clustering. The vertices that remain are vertices of the form, so
    colours and normals are looked up, not computed.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    step = float((high - low).max()) / cells or 1.0
    at = ((positions - low) / step).astype(np.int64)
    key = (at[:, 0] * (cells + 2) + at[:, 1]) * (cells + 2) + at[:, 2]
    _, first, cluster = np.unique(key, return_index=True, return_inverse=True)
    small = cluster[faces]
    kept = (
        (small[:, 0] != small[:, 1]) & (small[:, 1] != small[:, 2]) & (small[:, 2] != small[:, 0])
    )
    small = small[kept]
    low_first = np.argmin(small, axis=1)
    turned = small[np.arange(len(small))[:, None], (low_first[:, None] + np.arange(3)) % 3]
    count = np.int64(len(first))
    _, unique = np.unique(
        (turned[:, 0] * count + turned[:, 1]) * count + turned[:, 2], return_index=True
    )
    return first.astype(np.int64), np.ascontiguousarray(turned[unique], dtype=np.int64)


class StandIn:
    """The lighter surface of one heavy surface; it follows its positions and colours."""

    def __init__(self, surface: Surface) -> None:
        self._of = surface
        self._ids, faces = clustered(surface.positions, surface.faces)
        self.surface = Surface(surface.positions[self._ids], faces, (255, 255, 255))
        self.surface.actor.VisibilityOff()
        self.surface.actor.PickableOff()

    def follow(self) -> None:
        """Copy positions, normals and colours of the heavy surface."""
        self.surface.positions[:] = self._of.positions[self._ids]
        self.surface.normals[:] = self._of.normals[self._ids]
        self.surface.colours[:] = self._of.colours[self._ids]
        self.surface.refresh()
