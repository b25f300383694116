"""What a step makes of a mesh is looked at before anybody sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from engine import DataStep, Mesh, Run, SketchEdit
from engine.applied import StepError, applied
from tests.engine.shapes import plate

PLATE = plate(5)


@dataclass(frozen=True, eq=False)
class Shift(DataStep):
    """A plugin's step: moves everything along x."""

    by: float
    kind = "shift"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        return mesh.with_vertices(mesh.vertices + np.array([self.by, 0.0, 0.0]))


@dataclass(frozen=True, eq=False)
class Copy(DataStep):
    """A plugin's step: gives a mesh with faces of its own."""

    turned: bool
    kind = "copy"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        faces = mesh.faces[:, ::-1] if self.turned else mesh.faces
        return Mesh(mesh.vertices + 1, faces.copy())


@pytest.mark.parametrize("home", [0.0, 3e4])
def test_far_is_measured_from_where_the_form_stands(home: float) -> None:
    mesh = PLATE.with_vertices(PLATE.vertices + home * PLATE.diagonal)
    assert applied(Shift(9e3 * PLATE.diagonal), mesh).n == mesh.n
    for far in (2e4, -2e4):
        with pytest.raises(StepError, match="out of all reach"):
            applied(Shift(far * PLATE.diagonal), mesh)


def test_equal_faces_come_back_as_the_same_object_and_others_stay() -> None:
    same = applied(Copy(False), PLATE)
    assert same.faces is PLATE.faces
    assert (same.vertices == PLATE.vertices + 1).all()
    turned = applied(Copy(True), PLATE)
    assert (turned.faces == PLATE.faces[:, ::-1]).all()


def test_a_fault_of_our_own_is_not_called_a_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_args: object) -> Mesh:
        raise ZeroDivisionError

    monkeypatch.setattr(SketchEdit, "apply", fails)
    with pytest.raises(ZeroDivisionError):
        applied(SketchEdit(np.array([12]), 0.0, ()), PLATE)
    monkeypatch.setattr(Shift, "apply", fails)
    with pytest.raises(StepError, match="raised ZeroDivisionError"):
        applied(Shift(0.0), PLATE)
