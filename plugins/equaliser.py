"""Band equaliser: a gain for each band of feature sizes, in closed form."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from plugins.api import (
    F64,
    I64,
    Context,
    DataStep,
    Document,
    Mesh,
    RegionTool,
    Result,
    Run,
    Step,
    taken_apart,
)

GAIN = {"min": -2.0, "max": 4.0, "step": 0.05}


@dataclass(frozen=True, eq=False)
class EqualiserStep(DataStep):
    """Scales each mode by the gain of its feature size: base + sum g_i phi_i eta_i / lambda_i.

    `sizes` are the limits between bands in mesh units, descending (the wavelength of a mode is
    2 pi / sqrt(lambda)); `gains` has one number more: largest features first. Detail finer than
    the computed modes takes the last gain.
    """

    roi: I64
    sizes: tuple[float, ...]
    gains: tuple[float, ...] = field(metadata=GAIN)
    kind: ClassVar[str] = "equaliser"
    label: ClassVar[str] = "Equaliser"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the mesh with its bands amplified or damped."""
        parts = taken_apart(mesh, self.roi, None, run)
        wavelength = 2 * np.pi / np.sqrt(parts.eigenvalues)
        gain = np.asarray(self.gains)[np.searchsorted(-np.asarray(self.sizes), -wavelength)]
        weights = (gain - self.gains[-1])[:, None] * parts.eta / parts.eigenvalues[:, None]
        moved: F64 = parts.base + self.gains[-1] * (parts.original - parts.base)
        moved += parts.modes @ weights
        vertices = mesh.vertices.copy()
        vertices[parts.roi] = moved
        return mesh.with_vertices(vertices)


def _gain(name: str, tip: str) -> Any:
    return field(default=1.0, metadata={"label": name, "tip": tip, **GAIN})


@dataclass(frozen=True)
class EqualiserOptions:
    """A gain for each of four bands; 1 leaves a band as it is, 0 removes it."""

    large: float = _gain("Large forms", "Features above a quarter of the region")
    medium: float = _gain("Medium", "Features from an eighth to a quarter of the region")
    small: float = _gain("Small", "Features from a sixteenth to an eighth of the region")
    fine: float = _gain("Fine", "Features below a sixteenth of the region")


class Equaliser(RegionTool):
    """Amplifies or damps features by their size."""

    id = "equaliser"
    title = "Equaliser"
    tip = "Strengthen or soften the region's features by their size"
    icon = "mdi6.equalizer"
    label = "Equaliser"
    order = 120
    Options = EqualiserOptions

    def enter(self, context: Context) -> Result:
        """Apply nothing while every band stays as it is."""
        options = context.options
        if options.large == options.medium == options.small == options.fine == 1.0:
            return None
        return super().enter(context)

    def hint(self, document: Document) -> str:
        """Say what the numbers mean."""
        if document.draft.roi is None:
            return super().hint(document)
        return "Above 1 features of a size grow stronger, below 1 softer. {edit.apply} applies it"

    def step(self, roi: I64, options: EqualiserOptions, document: Document) -> Step:
        """Return the step for these options."""
        x = document.mesh.vertices[roi]
        size = float(np.linalg.norm(x.max(axis=0) - x.min(axis=0)))
        gains = (options.large, options.medium, options.small, options.fine)
        return EqualiserStep(roi, (size / 4, size / 8, size / 16), gains)
