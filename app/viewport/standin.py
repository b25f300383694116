"""A lighter form to show while a heavy one turns: its vertices clustered on a grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.viewport.surface import Surface
from engine.arrays import I64

CELLS_ACROSS = 128


def clustered(
    positions: NDArray[Any], faces: I64, cells: int = CELLS_ACROSS, kept: I64 | None = None
) -> tuple[I64, I64]:
    """Return one vertex id per occupied grid cell (c,) and the faces between them (g, 3).

    Rossignac and Borrel's vertex clustering. The vertices that remain are vertices of the form, so
    that colours and normals are looked up, not computed. Those in `kept` all remain: they are the
    part that one is working on.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    step = float((high - low).max()) / cells or 1.0
    at = ((positions - low) / step).astype(np.int64)
    key = (at[:, 0] * (cells + 2) + at[:, 1]) * (cells + 2) + at[:, 2]
    if kept is not None:
        key[kept] = (cells + 2) ** 3 + np.arange(len(kept))
    _, first, cluster = np.unique(key, return_index=True, return_inverse=True)
    small = cluster[faces]
    proper = (
        (small[:, 0] != small[:, 1]) & (small[:, 1] != small[:, 2]) & (small[:, 2] != small[:, 0])
    )
    return first.astype(np.int64), _without_doubles(small[proper], len(first))


def _without_doubles(faces: I64, n: int) -> I64:
    """Return each of `faces` (g, 3) once, in the orientation it has."""
    row, least = np.arange(len(faces))[:, None], np.argmin(faces, axis=1)[:, None]
    turned = faces[row, (least + np.arange(3)) % 3].astype(np.int64)
    _, once = np.unique((turned[:, 0] * n + turned[:, 1]) * n + turned[:, 2], return_index=True)
    return np.ascontiguousarray(turned[once])


class StandIn:
    """The lighter surface of one heavy surface; it follows its positions and colours.

    Parameters
    ----------
    surface : the heavy one.
    kept : ids of vertices that are shown as they are, or None.
    """

    def __init__(self, surface: Surface, kept: I64 | None = None) -> None:
        self._of = surface
        self._ids, faces = clustered(surface.positions, surface.faces, kept=kept)
        self.surface = Surface(surface.positions[self._ids], faces, (255, 255, 255))
        self.surface.actor.VisibilityOff()
        self.surface.actor.PickableOff()

    def follow(self) -> None:
        """Copy positions, normals and colours of the heavy surface."""
        self.surface.positions[:] = self._of.positions[self._ids]
        self.surface.normals[:] = self._of.normals[self._ids]
        self.surface.colours[:] = self._of.colours[self._ids]
        self.surface.refresh()
