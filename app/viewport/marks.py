"""Marks: curves and pins that lie on the form, as thick on screen wherever one looks from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from vtkmodules.vtkRenderingCore import vtkRenderer

from app.look import PIN, ROLE_COLOURS, rgb8
from app.viewport.camera import Eye
from app.viewport.curves import Solid, smooth_curve
from engine.arrays import F64

#: Thickness in logical pixels by role.
_LINE = {"rim": 2.5, "source": 5.0, "guide": 2.0, "region": 2.5, "target": 4.0, "pin": 12.0}


@dataclass(frozen=True, eq=False)
class _Curve:
    solids: list[Solid]
    points: F64
    dots: F64
    role: str
    closed: bool

    def is_of(self, points: F64, dots: F64, role: str, closed: bool) -> bool:
        """Whether it is what would be drawn of these."""
        same = (self.role, self.closed) == (role, closed)
        return same and np.array_equal(self.points, points) and np.array_equal(self.dots, dots)


class Marks:
    """Curves by name, and the pins; all places in scene units."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._renderer = renderer
        self.curves: dict[str, _Curve] = {}
        self._pins: Solid | None = None
        self._eye = Eye(np.zeros(3), 200.0)
        self._height = 600.0

    def show_curve(self, name: str, points: F64, role: str, closed: bool, dots: F64) -> bool:
        """Draw a curve (p, 3) with `dots` (a, 3) on it; return whether that is new."""
        before = self.curves.get(name)
        if before is not None and before.is_of(points, dots, role, closed):
            return False
        self.hide_curve(name)
        colour, width = ROLE_COLOURS[role], _LINE[role]
        solids = [Solid(colour, width, smooth_curve(points, closed), tube=True)]
        if role == "source":
            solids.append(Solid(_lighter(colour), 0.6 * width, dots, tube=False, lift=0.5 * width))
            if not closed:
                ends = np.stack([points[0], points[-1]])
                solids.append(Solid("#ffffff", 2.6 * width, ends, tube=False))
                solids.append(Solid(colour, 2.0 * width, ends, tube=False, lift=0.6 * width))
        self.curves[name] = _Curve(solids, points, dots, role, closed)
        for solid in solids:
            self._resize(solid)
            self._renderer.AddActor(solid.actor)
        return True

    def hide_curve(self, name: str) -> bool:
        """Take the curve of that name away; return whether there was one."""
        curve = self.curves.pop(name, None)
        for solid in curve.solids if curve is not None else ():
            self._renderer.RemoveActor(solid.actor)
        return curve is not None

    def set_pins(self, places: F64 | None) -> bool:
        """Show pins at `places` (p, 3), or none; return whether that is new."""
        before = self._pins
        if before is not None and places is not None and np.array_equal(before.points, places):
            return False
        if before is not None:
            self._renderer.RemoveActor(before.actor)
            self._pins = None
        if places is not None:
            self._pins = Solid(PIN, _LINE["pin"], places, tube=False, lift=1.0)
            self._resize(self._pins)
            self._renderer.AddActor(self._pins.actor)
        return before is not None or places is not None

    def clear(self) -> None:
        """Take all of them away."""
        self.set_pins(None)
        for name in list(self.curves):
            self.hide_curve(name)

    def seen_from(self, eye: Eye, height: float) -> None:
        """Give them their thickness as seen from `eye`, `height` logical pixels high."""
        self._eye, self._height = eye, height
        for solid in self._solids():
            self._resize(solid)

    @property
    def reach(self) -> float:
        """How far from the origin they are along an axis, at the most."""
        return max((float(np.abs(curve.points).max()) for curve in self.curves.values()), default=0)

    def _solids(self) -> Iterator[Solid]:
        for curve in self.curves.values():
            yield from curve.solids
        if self._pins is not None:
            yield self._pins

    def _resize(self, solid: Solid) -> None:
        solid.resize(
            self._eye.toward(solid.points), self._eye.unit_per_pixel(solid.points, self._height)
        )


def _lighter(colour: str, share: float = 0.55) -> str:
    mixed = (round(c + (255 - c) * share) for c in rgb8(colour))
    return "#" + "".join(f"{c:02x}" for c in mixed)
