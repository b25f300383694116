"""SketchEdit: steps 2 to 7 of Section 5.2 as one replayable step."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Self

from engine.arrays import F64, I64
from engine.mesh import Mesh
from engine.run import Run
from engine.view import View


@dataclass(frozen=True, eq=False)
class Source:
    """A source curve on the surface: its anchor vertices in order and the view it was drawn in."""

    anchors: I64
    view: View
    closed: bool = False
    weights: F64 | None = None


@dataclass(frozen=True, eq=False)
class Stroke:
    """A source curve and where it shall go: target (c, 2) px in `view`, one row an anchor."""

    anchors: I64
    view: View
    target: F64
    closed: bool = False
    weights: F64 | None = None


@dataclass(frozen=True)
class EditOptions:
    """How an edit is solved."""

    rim: Literal["smooth", "paper"] = "smooth"
    rectify: bool = True
    depth_hold: float = 0.02
    amount: float = 1.0
    polish: int = 0


@dataclass(frozen=True, eq=False)
class SketchEdit:
    """Reshape `roi` at `level` so that the strokes' anchors meet their targets."""

    roi: I64
    level: float
    strokes: tuple[Stroke, ...]
    options: EditOptions = field(default_factory=EditOptions)
    kind: ClassVar[str] = "sketch"

    @property
    def title(self) -> str:
        return "Sketch"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        raise NotImplementedError

    def to_json(self) -> dict[str, Any]:
        raise NotImplementedError

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        raise NotImplementedError
