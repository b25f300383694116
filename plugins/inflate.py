"""Inflate: push the region out along the normals of its plain form, fading out at the rim."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from plugins.api import I64, DataStep, Document, Mesh, RegionTool, Run, Step, option, taken_apart


@dataclass(frozen=True, eq=False)
class InflateStep(DataStep):
    """Moves the region by `distance` mesh units at its middle, along the base shape's normals.

    Along its own normals a bump would swell to a mushroom; so the details ride along. The weight
    is the height of a membrane under pressure (K u = M 1, u = 0 at the rim), scaled to 1 and
    eased, so that it leaves the rim without a crease.
    """

    roi: I64
    distance: float
    flatness: float = field(default=0.0, metadata={"min": 0.0, "max": 1.0})
    kind: ClassVar[str] = "inflate"
    label: ClassVar[str] = "Inflate"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the inflated mesh."""
        parts = taken_apart(mesh, self.roi, 0.0, run)
        vertices = mesh.vertices.copy()
        vertices[parts.roi] = parts.base
        normals = mesh.with_vertices(vertices).vertex_normals[parts.roi]
        height = parts.factor.solve(parts.areas[:, None])[:, 0]
        share = np.clip(height / height.max() / (1.0 - 0.6 * self.flatness), 0.0, 1.0)
        weight = share**2 * (3 - 2 * share)
        vertices[parts.roi] = parts.original + self.distance * weight[:, None] * normals
        return mesh.with_vertices(vertices)


@dataclass(frozen=True)
class InflateOptions:
    """What the person sets."""

    distance: float = option(
        2.0,
        "Distance",
        "How far the middle moves out; negative moves it in",
        of_size=0.0075,
    )
    flatness: float = option(
        0.0, "Flatness", "0 is a dome, 1 a plateau with a soft edge", low=0.0, high=1.0, step=0.05
    )


class Inflate(RegionTool):
    """Pushes the region out or in."""

    id = "inflate"
    title = "Inflate"
    tip = "Push the region out along its normals, or in"
    icon = "mdi6.arrow-expand-all"
    label = "Inflate"
    order = 130
    Options = InflateOptions

    def step(self, roi: I64, options: InflateOptions, document: Document) -> Step:
        """Return the step for these options."""
        return InflateStep(roi, options.distance, options.flatness)
