"""Between two shapes of one region: form and detail go from one to the other separately.

Form is what the first modes hold together with the base shape, detail is the rest. (The base shape
alone would not do: it follows from the rims, which both shapes share.) With f the share of the
form and d that of the detail,

    form    F = (1 - f) S + f S'
    result  x = F + (1 - d) L^-1 (R h) + d L'^-1 (R' h')

where S is a shape's surface at that level, h its Laplacian coordinates above it (Eq. 14), and R the
local rotations that take S to F (Eqs. 18 to 20; `Details` says what L^-1 stands for).
"""

from __future__ import annotations

from engine.arrays import F64, I64
from engine.decomposition import decompose
from engine.details import Details
from engine.errors import RegionError
from engine.mesh import Mesh
from engine.operators import laplacian
from engine.rectify import ring_products, ring_rotations
from engine.run import Run

# About a third of the region across: what a person would call its form, unless told otherwise.
FORM_MODES = 16
_LEAST_SHARE = 4  # a small region keeps at least three quarters of its modes for detail


class Side:
    """One of the two shapes, taken apart at the level that divides form from detail.

    Parameters
    ----------
    mesh : the shape.
    roi : (r,) ids of the vertices that differ.
    modes : how many of the first modes count as form.
    """

    def __init__(self, mesh: Mesh, roi: I64, run: Run, modes: int = FORM_MODES) -> None:
        count = min(modes, len(roi) // _LEAST_SHARE)
        self.parts = decompose(mesh, roi, count, run=run)
        region = self.parts.region
        k = min(count, self.parts.k)
        self.form = self.parts.surface(k)
        rest = region.x.copy()
        rest[: region.m] = (self.form - region.centre) / region.scale
        self._details = Details(self.parts, k)
        self._rings = ring_products(
            rest, laplacian(rest, region.faces).stiffness, self._details.rows
        )

    def detail(self, patch: F64) -> F64:
        """Return the offsets (m, 3) of this shape's detail on the form at `patch` (p, 3).

        x - S + L^-1 (R h - h) is L^-1 R h in the form that is exact where nothing turns.
        """
        region = self.parts.region
        deformed = (patch - region.centre) / region.scale
        return (
            self.parts.original
            - self.form
            + self._details.turning(ring_rotations(self._rings, deformed))
        )


class Morph:
    """Two shapes of one mesh, taken apart; `at` is quick.

    Parameters
    ----------
    mesh : the one shape.
    other : the other one, on the same faces.
    roi : (r,) ids of the vertices that differ.
    modes : how many of the first modes count as form; the rest is detail.

    Raises
    ------
    RegionError
        The shapes differ all over a part of the model, or only at open borders.
    """

    def __init__(
        self,
        mesh: Mesh,
        other: Mesh,
        roi: I64,
        run: Run | None = None,
        modes: int = FORM_MODES,
    ) -> None:
        run = run or Run()
        self._mesh, self._other, self._roi = mesh, other, roi
        try:
            self._sides = Side(mesh, roi, run, modes), Side(other, roi, run, modes)
        except RegionError as error:
            raise RegionError(
                "Form and detail of these two cannot be told apart: nothing beside what differs "
                "stays the same. Compare steps that leave a part of the model as it was."
            ) from error

    def at(self, form: float, detail: float) -> F64:
        """Return all positions (n, 3); 0, 0 gives the one shape and 1, 1 the other to the bit."""
        if form == detail == 0.0:
            return self._mesh.vertices
        if form == detail == 1.0:
            return self._other.vertices
        here, there = self._sides
        region = here.parts.region
        x = self._mesh.vertices.copy()
        # Vertices on open borders have no detail of their own and go along with the form.
        x[self._roi] += form * (self._other.vertices[self._roi] - x[self._roi])
        blended = here.form + form * (there.form - here.form)
        x[region.roi] = blended
        patch = x[region.patch]
        x[region.roi] = blended + (1.0 - detail) * here.detail(patch) + detail * there.detail(patch)
        return x
