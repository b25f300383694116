"""Remesh: even triangles where an edit has stretched them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from plugins.api import I64, DataStep, Document, Mesh, RegionTool, Run, Step, option, remesh


@dataclass(frozen=True, eq=False)
class RemeshStep(DataStep):
    """Gives the region new triangles with edges of `length` mesh units; the form stays."""

    roi: I64
    length: float = field(metadata={"min": 1e-12, "max": 1e12})
    kind: ClassVar[str] = "remesh"
    label: ClassVar[str] = "Remesh"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the remeshed mesh; outside the region every vertex keeps its place."""
        return remesh(mesh, self.roi, self.length, run)


@dataclass(frozen=True)
class RemeshOptions:
    """What the person sets."""

    density: float = option(
        1.0,
        "Density",
        "1 takes the edge length around the region; 2 is twice as fine",
        low=0.25,
        high=4.0,
        step=0.25,
    )


class Remesh(RegionTool):
    """Gives the region even triangles."""

    id = "remesh"
    title = "Remesh"
    tip = "Give the region even triangles, as fine as those around it"
    icon = "mdi6.triangle-outline"
    label = "Remesh"
    order = 160
    live = False
    Options = RemeshOptions

    def step(self, roi: I64, options: RemeshOptions, document: Document) -> Step:
        """Return the step for these options."""
        return RemeshStep(roi, edge_length_around(document.mesh, roi) / options.density)


def edge_length_around(mesh: Mesh, roi: I64) -> float:
    """Return the median length of the edges outside a region, mesh units."""
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    edges = mesh.topology.edges
    outer = edges[~inside[edges].all(axis=1)]
    chosen = outer if len(outer) else edges
    ends = mesh.vertices[chosen]
    return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
