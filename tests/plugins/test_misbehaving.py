"""What a bad step does to a replay: nothing, and it is named."""

from __future__ import annotations

import numpy as np
import pytest

from engine import EngineError, Mesh, Recipe, StepError, applied, replay
from plugins.remesh import RemeshStep
from tests.plugins.flat import plate
from tests.plugins.misbehaving import STEPS, BadStep


@pytest.mark.parametrize("how", STEPS)
def test_a_bad_step_is_named_and_nothing_is_changed(how: str) -> None:
    mesh = plate()
    digest = Mesh(mesh.vertices.copy(), mesh.faces).digest
    with pytest.raises(StepError, match="The step “Bad” failed: it"):
        replay(Recipe((BadStep(how),)), mesh)
    assert Mesh(mesh.vertices.copy(), mesh.faces).digest == digest


def test_faces_that_were_copied_come_back_as_the_same_object() -> None:
    mesh = plate()
    after = applied(BadStep("copies_faces"), mesh)
    assert after.faces is mesh.faces
    assert (after.vertices == mesh.vertices + 1.0).all()


def test_what_a_step_says_itself_is_passed_on() -> None:
    mesh = plate()
    with pytest.raises(EngineError, match="Choose") as caught:
        applied(RemeshStep(np.arange(5), 1.0), mesh)
    assert not isinstance(caught.value, StepError)
