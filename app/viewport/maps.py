"""What colours the form: clay, stripes that it reflects, or a map with its scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.viewport.camera import Eye
from app.viewport.shading import (
    Display,
    legend,
    mapped,
    round_up,
    set_stripes,
    signed_deviation,
    signed_mean_curvature,
    turn_stripes,
)
from engine.arrays import F64, frozen

if TYPE_CHECKING:
    from app.viewport.layers import Layers


class Maps:
    """The viewport's way of colouring, and what it needs to keep for that."""

    def __init__(self, viewport: Layers) -> None:
        self._viewport = viewport
        self._reference: F64 | None = None
        self._most = 0.0
        self._curvature_of: object = None
        self.display: Display = "clay"
        self.unit = "mm"

    def new_form(self) -> None:
        """Forget what belonged to the form before."""
        self._reference = None
        self._curvature_of = None
        self.show(self.display)

    def show(self, display: Display) -> None:
        """Colour the form by `display`."""
        self.display = display
        self._most = 0.0
        surface = self._viewport.scene.surface
        if surface is None:
            return
        set_stripes(surface.actor.GetShaderProperty(), display)
        self.turned(self._viewport.eye)
        if display == "curvature":
            self._curvature()
        elif display == "deviation":
            self._deviation()
        else:
            self._viewport.scene.set_map(None)
            self._viewport.overlay.set_legend(None)

    def set_reference(self, positions: ArrayLike | None) -> None:
        """Measure deviation from positions (n, 3); None for the form as it was set."""
        self._reference = None if positions is None else frozen(positions, np.float64)
        self._most = 0.0
        self.moved()

    def moved(self) -> None:
        """Follow the form while it moves, as far as that is quick."""
        if self.display == "deviation" and self._viewport.form is not None:
            self._deviation()

    def rested(self) -> None:
        """Follow the form now that it rests."""
        surface = self._viewport.scene.surface
        stale = surface is not None and self._curvature_of != surface.stamp
        if self.display == "curvature" and stale:
            self._curvature()

    def turned(self, eye: Eye) -> None:
        """Keep stripes upright while the camera turns."""
        surface = self._viewport.scene.surface
        if self.display in ("zebra", "reflection") and surface is not None:
            turn_stripes(surface.actor.GetShaderProperty(), eye.axes[:, eye.up])

    def deviation(self) -> F64:
        """Return the signed distance of each vertex from the reference, (n,), mesh units."""
        form, surface = self._viewport.form, self._viewport.scene.surface
        assert form is not None
        assert surface is not None
        reference = form.vertices if self._reference is None else self._reference
        return signed_deviation(self._viewport.vertices, reference, surface.normals)

    def _deviation(self) -> None:
        values = self.deviation()
        # The scale only grows while one edits, so that colours keep their meaning.
        self._most = max(self._most, round_up(float(np.abs(values).max())))
        self._viewport.scene.set_map(mapped(values, self._most))
        self._viewport.overlay.set_legend(legend(f"Deviation, {self.unit}", self._most))

    def _curvature(self) -> None:
        form, surface = self._viewport.form, self._viewport.scene.surface
        assert form is not None
        assert surface is not None
        values = signed_mean_curvature(form.with_vertices(self._viewport.vertices))
        self._most = round_up(float(np.percentile(np.abs(values), 96)))
        self._viewport.scene.set_map(mapped(values, self._most))
        self._viewport.overlay.set_legend(legend(f"Mean curvature, 1/{self.unit}", self._most))
        self._curvature_of = surface.stamp
