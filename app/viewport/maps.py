"""What colours the form: clay, stripes that it reflects, or a map with its scale."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.viewport.around import differing
from app.viewport.camera import Eye
from app.viewport.shading import (
    Display,
    Stripes,
    legend,
    mapped,
    round_up,
    set_stripes,
    signed_deviation,
    signed_mean_curvature,
    turn_stripes,
)
from engine import Mesh
from engine.arrays import F64, I64, frozen

if TYPE_CHECKING:
    from app.viewport.layers import Layers


AT_ONCE = 12_000  # vertices whose curvature is there in a moment


@dataclass(frozen=True, eq=False)
class Curvature:
    """The map of a form's mean curvature.

    Parameters
    ----------
    stamp : of the surface that it is of.
    most : where its scale ends, 1 / mesh unit.
    colours : (n, 3).
    """

    stamp: tuple[int, int]
    most: float
    colours: NDArray[np.uint8]

    @classmethod
    def of(cls, mesh: Mesh, stamp: tuple[int, int]) -> Curvature:
        """Work it out; in any thread."""
        values = signed_mean_curvature(mesh)
        most = round_up(float(np.percentile(np.abs(values), 96)))
        return cls(stamp, most, mapped(values, most))


class Maps:
    """The viewport's way of colouring, and what it needs to keep for that."""

    def __init__(self, viewport: Layers) -> None:
        self._viewport = viewport
        self._reference: F64 | None = None
        self._most = 0.0
        self._curvature_of: object = None
        self._asked: object = None  # the stamp of the form whose curvature is being worked out
        self._values: F64 | None = None  # deviation of each vertex, as it is shown
        self.display: Display = "clay"
        self.stripes = Stripes()
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
        self._asked = self._values = None
        surface = self._viewport.scene.surface
        if surface is None:
            return
        set_stripes(surface.actor.GetShaderProperty(), display, self.stripes)
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
        self._values = None
        self.moved()

    def moved(self, ids: I64 | None = None) -> None:
        """Follow the form while all of it, or the vertices `ids`, move, as far as that is quick."""
        if self.display == "deviation" and self._viewport.form is not None:
            self._deviation(ids)

    @property
    def under_way(self) -> bool:
        """Whether a map is being worked out."""
        return self._asked is not None

    def rested(self) -> None:
        """Follow the form now that it rests."""
        surface = self._viewport.scene.surface
        stale = surface is not None and self._curvature_of != surface.stamp
        if self.display == "curvature" and stale:
            self._curvature()

    def turned(self, eye: Eye) -> None:
        """Keep stripes where they belong while the camera turns."""
        surface = self._viewport.scene.surface
        if self.display in ("zebra", "reflection") and surface is not None:
            turn_stripes(surface.actor.GetShaderProperty(), self.stripes, eye.axes[:, eye.up])

    def deviation(self, ids: I64 | None = None) -> F64:
        """Return the signed distance of vertices, or all, from the reference, mesh units."""
        form, surface = self._viewport.form, self._viewport.scene.surface
        assert form is not None
        assert surface is not None
        reference = form.vertices if self._reference is None else self._reference
        here = self._viewport.vertices
        if ids is not None:
            return signed_deviation(here[ids], reference[ids], surface.normals[ids])
        values, apart = np.zeros(len(here)), differing(here, reference)
        values[apart] = self.deviation(apart)
        return values

    def _deviation(self, ids: I64 | None = None) -> None:
        if self._values is None or ids is None:
            self._values = changed = self.deviation()
            ids = None
        else:
            self._values[ids] = changed = self.deviation(ids)
        # The scale only grows while one edits, so that colours keep their meaning.
        most = max(self._most, round_up(float(np.abs(changed).max(initial=0.0))))
        scene = self._viewport.scene
        if ids is not None and most == self._most:
            scene.recolour_map(mapped(changed, most), ids)
            return
        self._most = most
        scene.set_map(mapped(self._values, most))
        self._viewport.overlay.set_legend(legend(f"Deviation, {self.unit}", most))

    def _curvature(self) -> None:
        form, surface = self._viewport.form, self._viewport.scene.surface
        assert form is not None
        assert surface is not None
        stamp, here = surface.stamp, form.with_vertices(self._viewport.vertices)
        if form.n <= AT_ONCE:
            self.take_curvature(Curvature.of(here, stamp))
        elif self._asked != stamp:
            self._asked = stamp
            self._begin(here, stamp)

    def _begin(self, mesh: Mesh, stamp: tuple[int, int]) -> None:
        """Work the curvature out in a thread; the form keeps the colours it has meanwhile."""
        curved = self._viewport.curved

        def work() -> None:
            made = Curvature.of(mesh, stamp)
            with suppress(RuntimeError):  # the window was closed meanwhile
                curved.emit(made)

        threading.Thread(target=work, name="curvature", daemon=True).start()

    def take_curvature(self, made: Curvature) -> None:
        """Show a map of curvature that was worked out, unless it is late."""
        if self._asked == made.stamp:
            self._asked = None
        surface = self._viewport.scene.surface
        if surface is None or surface.stamp != made.stamp or self.display != "curvature":
            return
        self._most = made.most
        self._viewport.scene.set_map(made.colours)
        self._viewport.overlay.set_legend(legend(f"Mean curvature, 1/{self.unit}", made.most))
        self._curvature_of = made.stamp
        self._viewport.update()
