"""A slice of the robustness measure; the whole of it is `python -m bench.robustness FOLDER`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench import broken
from bench.robustness import random_region, wrong_with
from engine import EngineError, Mesh
from engine.arrays import I64
from tests.engine.surfaces import real


def _right_or_refused(mesh: Mesh, roi: I64) -> bool:
    try:
        return wrong_with(mesh, roi) == ""
    except EngineError as error:
        # A fact and a remedy: two sentences.
        return str(error).count(".") >= 2


@pytest.mark.parametrize("kind", list(broken.KINDS))
def test_random_regions_of_broken_meshes_come_back_right_or_are_refused(kind: str) -> None:
    for seed in range(3):
        mesh = broken.KINDS[kind](seed)
        rng = np.random.default_rng(seed)
        for _ in range(2):
            roi = random_region(mesh, rng)
            assert _right_or_refused(mesh, roi), (seed, len(roi), int(roi[0]))


@pytest.mark.parametrize(
    "name", ["armadillo.obj", "boot.obj", "hammer.obj", "spot.obj", "fish.obj"]
)
def test_random_regions_of_real_meshes_come_back_right(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    rng = np.random.default_rng(1)
    for _ in range(3):
        assert wrong_with(mesh, random_region(mesh, rng)) == ""


@pytest.mark.parametrize("size", range(1, 11))
def test_regions_of_one_to_ten_vertices(size: int) -> None:
    for kind in ("slivers", "needles", "noise", "spikes"):
        mesh = broken.KINDS[kind](1)
        start = mesh.n // 2 + 7
        distance = np.linalg.norm(mesh.vertices - mesh.vertices[start], axis=1)
        roi = np.argsort(distance, kind="stable")[:size]
        assert _right_or_refused(mesh, roi)
