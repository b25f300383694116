"""What a live preview asks for again is worked out once."""

from __future__ import annotations

import numpy as np
import pytest

import plugins.parts
from engine import Mesh, Run, decompose_until
from plugins.api import taken_apart
from plugins.equaliser import EqualiserStep
from plugins.inflate import InflateStep
from plugins.smooth import SmoothStep
from plugins.symmetrise import SymmetriseStep
from tests.app.driving import bumpy_sphere


@pytest.fixture(scope="module")
def sphere() -> Mesh:
    return bumpy_sphere(1500)


@pytest.mark.parametrize(
    "make",
    [
        lambda roi, share: SmoothStep(roi, 0.0, share),
        lambda roi, share: InflateStep(roi, 3 * share),
        lambda roi, share: EqualiserStep(roi, (20.0,), (1.0, share)),
        lambda roi, share: SymmetriseStep(roi, (1.0, 0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), share),
    ],
)
def test_another_number_needs_no_other_decomposition(make, sphere: Mesh, monkeypatch) -> None:
    roi = np.flatnonzero(sphere.vertices[:, 0] > 20)
    alone = [make(roi, share).apply(sphere).vertices for share in (0.3, 0.6)]
    run = Run()
    first = make(roi, 0.3).apply(sphere, run).vertices
    for name in ("decompose", "decompose_until"):
        monkeypatch.setattr(plugins.parts, name, None)
    second = make(roi, 0.6).apply(sphere, run).vertices
    assert (first == alone[0]).all()
    assert (second == alone[1]).all()


def test_the_bits_are_those_of_the_engine(sphere: Mesh) -> None:
    roi = np.flatnonzero(sphere.vertices[:, 2] > 15)
    ours, theirs = taken_apart(sphere, roi, 0.2), decompose_until(sphere, roi, 0.2)
    k = theirs.mode_count(0.2)
    assert (ours.surface(k) == theirs.surface(k)).all()
