"""A lighter form to show while a heavy one turns; the region in it stays as it is."""

from __future__ import annotations

import numpy as np
from scipy import sparse as sp

from app.viewport.around import faces_about
from app.viewport.heavy import Lighter
from app.viewport.surface import Surface
from engine.arrays import I64


def with_kept(
    lighter: Lighter, faces: I64, incidence: sp.csr_array, kept: I64 | None
) -> tuple[I64, I64]:
    """Return the vertices (c,) and faces (g, 3) of a lighter form in which some vertices stay.

    Parameters
    ----------
    faces : (f, 3) of the form itself.
    incidence : (n, f), which faces are around a vertex.
    kept : ascending ids of the vertices that stay with all the faces around them: the part that
        one works on.
    """
    if kept is None or len(kept) == 0:
        return lighter.ids, lighter.faces
    about = faces_about(kept, incidence)
    became = lighter.face[about]
    # A face of the lighter form goes when nothing but faces about the region became it.
    left = lighter.count - np.bincount(became[became >= 0], minlength=len(lighter.faces))
    ids = np.concatenate([lighter.ids, kept])
    corners = faces[about]
    at = np.minimum(np.searchsorted(kept, corners), len(kept) - 1)
    whole = np.where(kept[at] == corners, len(lighter.ids) + at, lighter.cell[corners])
    return ids, np.concatenate([lighter.faces[left > 0], whole])


class StandIn:
    """The lighter surface of one heavy surface; it follows its positions and colours.

    Parameters
    ----------
    surface : the heavy one.
    ids, faces : vertices of the heavy one that it has, and its faces in positions of these.
    """

    def __init__(self, surface: Surface, ids: I64, faces: I64) -> None:
        self._of = surface
        self.ids = ids
        self._here: tuple[I64, I64] | None = None  # vertices that moved, and which here these are
        self.surface = Surface(
            surface.positions[ids], faces, (255, 255, 255), normals=surface.normals[ids]
        )
        self.surface.actor.VisibilityOff()
        self.surface.colours[:] = surface.colours[ids]
        self.surface.actor.PickableOff()

    def follow(self) -> None:
        """Copy positions, normals and colours of the heavy surface."""
        self.surface.positions[:] = self._of.positions[self.ids]
        self.surface.normals[:] = self._of.normals[self.ids]
        self.surface.moved()
        self.recolour()

    def follow_at(self, moved: I64) -> None:
        """Copy positions and normals of some vertices of the heavy surface.

        Parameters
        ----------
        moved : ids in the heavy one; the same array again and again is fastest.
        """
        if self._here is None or self._here[0] is not moved:
            there = np.zeros(self._of.n, dtype=bool)
            there[moved] = True
            self._here = (moved, np.flatnonzero(there[self.ids]))
        here = self._here[1]
        self.surface.positions[here] = self._of.positions[self.ids[here]]
        self.surface.normals[here] = self._of.normals[self.ids[here]]
        self.surface.moved()

    def recolour(self) -> None:
        """Copy the colours of the heavy surface."""
        self.surface.colours[:] = self._of.colours[self.ids]
        self.surface.recoloured()
