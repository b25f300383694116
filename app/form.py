"""Form: a surface as it is shown, told by where it differs from a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from engine import Mesh
from engine.arrays import F64, I64

_NONE: I64 = np.zeros(0, dtype=np.int64)
_NOWHERE: F64 = np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Form:
    """A mesh of which some vertices are elsewhere.

    What is shown changes many times a second, and only in the region: all other vertices are
    neither copied nor compared.

    Parameters
    ----------
    mesh : where all other vertices are.
    ids : (m,) ascending ids of the vertices that may be elsewhere.
    places : (m, 3) where these are, mesh units.
    """

    mesh: Mesh
    ids: I64 = field(default_factory=lambda: _NONE)
    places: F64 = field(default_factory=lambda: _NOWHERE)

    @cached_property
    def whole(self) -> Mesh:
        """The surface as a mesh; a copy is made when somebody asks for it."""
        if len(self.ids) == 0:
            return self.mesh
        vertices = self.mesh.vertices.copy()
        vertices[self.ids] = self.places
        vertices.flags.writeable = False  # the mesh made of it then takes it without a copy
        return self.mesh.with_vertices(vertices)

    def at(self, ids: I64) -> F64:
        """Return where the vertices `ids` are, (k, 3)."""
        if ids is self.ids:
            return self.places
        there: F64 = self.mesh.vertices[ids]
        if len(self.ids):
            place = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
            elsewhere = self.ids[place] == ids
            there[elsewhere] = self.places[place[elsewhere]]
        return there
