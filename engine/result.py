"""EditResult: the surface after an edit, and what it did to it; LevelResult: at its level only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from engine.arrays import F64, I64
from engine.intersections import self_intersections
from engine.measure import Stretch, edge_stretch
from engine.mesh import Mesh


@dataclass(frozen=True, eq=False)
class LevelResult:
    """What an edit makes of the surface at its level.

    Parameters
    ----------
    level_vertices : (n, 3) the surface at the level, deformed, without the finer details.
    target_error_px : largest distance of a reprojected anchor from its target, px; with `amount`,
        from its share of the way there. Of an outline as it is seen, where that has the target.
    mesh : the mesh before.
    roi : (m,) the vertices that could move.
    """

    level_vertices: F64
    target_error_px: float
    mesh: Mesh
    roi: I64


@dataclass(frozen=True, eq=False)
class EditResult(LevelResult):
    """What an edit gives.

    Parameters
    ----------
    vertices : (n, 3) with the details put back.
    """

    vertices: F64

    @cached_property
    def stretch(self) -> Stretch:
        """How much the edges changed length."""
        return edge_stretch(self.mesh, self.mesh.with_vertices(self.vertices), self.roi)

    @cached_property
    def self_intersections(self) -> I64:
        """Pairs of faces that run through each other now and did not before, (p, 2)."""
        after = self_intersections(self.mesh.with_vertices(self.vertices), self.roi)
        if len(after) == 0:
            return after
        before = self_intersections(self.mesh, self.roi)
        f = len(self.mesh.faces)
        new = ~np.isin(after[:, 0] * f + after[:, 1], before[:, 0] * f + before[:, 1])
        return np.asarray(after[new])
