"""Smooth: fair the region towards its base shape, or towards any level of detail."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from plugins.api import (
    I64,
    DataStep,
    Document,
    Mesh,
    RegionTool,
    Run,
    Step,
    option,
    taken_apart,
)

LEVEL = {"label": "Level", "tip": "0 is the base shape", "min": 0.0, "max": 1.0, "step": 0.01}
AMOUNT = {"label": "Amount", "tip": "1 reaches the level", "min": 0.0, "max": 1.0, "step": 0.05}


@dataclass(frozen=True, eq=False)
class SmoothStep(DataStep):
    """Moves the region by `amount` of the way to its surface at `level` (Eq. 15)."""

    roi: I64
    level: float = field(default=0.0, metadata=LEVEL)
    amount: float = field(default=1.0, metadata=AMOUNT)
    kind: ClassVar[str] = "smooth"
    label: ClassVar[str] = "Smooth"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the faired mesh."""
        parts = taken_apart(mesh, self.roi, self.level, run)
        goal = parts.surface(parts.mode_count(self.level))
        vertices = mesh.vertices.copy()
        vertices[parts.roi] += self.amount * (goal - parts.original)
        return mesh.with_vertices(vertices)


@dataclass(frozen=True)
class SmoothOptions:
    """What the person sets."""

    amount: float = field(default=0.5, metadata=AMOUNT)
    to_base: bool = option(False, "Down to the base", "Else down to the level of the slider")


class Smooth(RegionTool):
    """Fairs the region."""

    id = "smooth"
    title = "Smooth"
    tip = "Smooth the region towards its base shape or the level of the slider"
    icon = "mdi6.blur"
    label = "Smooth"
    order = 110
    Options = SmoothOptions

    def step(self, roi: I64, options: SmoothOptions, document: Document) -> Step:
        """Return the step for these options."""
        level = 0.0 if options.to_base else document.draft.level
        return SmoothStep(roi, level, options.amount)
