"""Morph: the form and the detail of another variant, each as far as one likes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from plugins.api import F64, I64, DataStep, EngineError, Mesh, Morph, Run

MOST_MODES = 400
SHARE = {"min": 0.0, "max": 1.0, "step": 0.01}


@dataclass(frozen=True, eq=False)
class MorphStep(DataStep):
    """Takes the form and the detail of the region to those of another variant.

    Parameters
    ----------
    roi : (r,) ids of the vertices that differ.
    other : 3 r numbers, where the other variant has them: x, y, z of the first, and so on.
    form, detail : 0 for this one, 1 for the other.
    modes : how many of the first modes count as form; what is finer is detail.
    """

    roi: I64
    other: tuple[float, ...]
    form: float = field(default=0.0, metadata=SHARE)
    detail: float = field(default=0.0, metadata=SHARE)
    modes: int = field(default=16, metadata={"min": 1, "max": MOST_MODES})
    kind: ClassVar[str] = "morph"
    label: ClassVar[str] = "Morph"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the mesh between the two."""
        run = run or Run()
        roi = np.asarray(self.roi)
        if len(self.other) != 3 * len(roi) or len(roi) == 0 or roi.max() >= mesh.n:
            raise EngineError(
                "This morph was made for another mesh. Compare the two variants there, and keep "
                "it again."
            )
        other = np.array(self.other).reshape(-1, 3)
        morph = run.memo.get(
            ("morph", mesh.digest, roi.tobytes(), other.tobytes(), self.modes),
            lambda: Morph(mesh, _placed(mesh, roi, other), roi, run, self.modes),
        )
        return mesh.with_vertices(morph.at(self.form, self.detail))


def morph_between(mesh: Mesh, other: Mesh) -> MorphStep:
    """Return the step that leaves `mesh` as it is, towards `other`.

    Raises
    ------
    EngineError
        The two have other triangles, or are the same.
    """
    same_faces = mesh.faces is other.faces or np.array_equal(mesh.faces, other.faces)
    if not same_faces or mesh.n != other.n:
        raise EngineError(
            "The two have different triangles, so nothing lies between them. "
            "Compare steps on the same side of a remesh."
        )
    roi = np.flatnonzero((mesh.vertices != other.vertices).any(axis=1))
    if len(roi) == 0:
        raise EngineError("The two are the same form. Compare two that differ.")
    return MorphStep(roi, tuple(other.vertices[roi].ravel().tolist()))


def _placed(mesh: Mesh, roi: I64, positions: F64) -> Mesh:
    vertices = mesh.vertices.copy()
    vertices[roi] = positions
    return mesh.with_vertices(vertices)
