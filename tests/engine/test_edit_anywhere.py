"""Edits do not depend on where and how a mesh lies, and survive broken ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from bench import broken
from bench.robustness import random_region
from engine import EditOptions, EngineError, Mesh, Region, SketchEdit, Stroke, View, cholmod
from engine.arrays import I64
from tests.engine.surfaces import real

from .shapes import camera, inner, plate
from .test_edit import SIDE, lifted, row_of

SMALL = plate(19, wave=0.02)
EDIT = SketchEdit(
    inner(SMALL, 0.1, 0.9), 0.2, (lifted(SMALL, SIDE, row_of(SMALL, 0.5, 0.25, 0.75), 40),)
)
EXPECTED = EDIT.apply(SMALL).vertices


@settings(max_examples=10, deadline=None)
@given(vector=st.tuples(*[st.floats(-3, 3)] * 3), polish=st.sampled_from([0, 3]))
def test_a_rigid_motion_of_everything_moves_the_result(
    vector: tuple[float, float, float], polish: int
) -> None:
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    turn[:3, 3] = 3.0, -2.0, 5.0
    there = Mesh(SMALL.vertices @ turn[:3, :3].T + turn[:3, 3], SMALL.faces)
    view = View(SIDE.matrix @ np.linalg.inv(turn), SIDE.size)
    options = EditOptions(polish=polish)
    here = EXPECTED if polish == 0 else replace(EDIT, options=options).apply(SMALL).vertices
    edit = replace(EDIT, strokes=(replace(EDIT.strokes[0], view=view),), options=options)
    back = (edit.apply(there).vertices - turn[:3, 3]) @ turn[:3, :3]
    assert np.abs(back - here).max() < 1e-7


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_numbering_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    new = rng.permutation(SMALL.n)
    x = np.empty_like(SMALL.vertices)
    x[new] = SMALL.vertices
    faces = np.roll(new[SMALL.faces], int(rng.integers(3)), axis=1)
    mesh = Mesh(x, faces[rng.permutation(len(faces))])
    stroke = replace(EDIT.strokes[0], anchors=new[EDIT.strokes[0].anchors])
    after = replace(EDIT, roi=np.sort(new[EDIT.roi]), strokes=(stroke,)).apply(mesh).vertices
    assert np.abs(after[new] - EXPECTED).max() < 1e-8


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_order_of_anchors_and_strokes_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stroke = EDIT.strokes[0]
    order = rng.permutation(len(stroke.anchors))
    a, b = order[: len(order) // 2], order[len(order) // 2 :]
    parts = tuple(
        replace(stroke, anchors=stroke.anchors[i], target=stroke.target[i]) for i in (a, b)
    )
    assert np.abs(replace(EDIT, strokes=parts).apply(SMALL).vertices - EXPECTED).max() < 1e-8


def test_without_cholmod_the_result_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cholmod, "usable", lambda: False)
    assert np.abs(EDIT.apply(SMALL).vertices - EXPECTED).max() < 1e-8


def random_edit(mesh: Mesh, roi: I64, rng: np.random.Generator) -> SketchEdit:
    """A chain between two vertices of the region, pulled up to 80 px aside in some view."""
    region = Region(mesh, roi)
    ends = rng.integers(region.m, size=2)
    ways = mesh.topology.adjacency[region.roi][:, region.roi]
    _, before = dijkstra(ways, indices=ends[0], unweighted=True, return_predecessors=True)
    chain = [int(ends[1])]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    anchors = region.roi[np.array(chain)]
    eye = region.centre + 2 * region.scale * Rotation.random(rng=rng).apply([0, 0, 1])
    view = camera(tuple(eye), tuple(region.centre), tuple(rng.normal(size=3)))
    push = rng.uniform(5, 80) * np.sin(np.linspace(0.3, 2.8, len(anchors)))
    target = view.project(mesh.vertices[anchors]) + push[:, None] * rng.uniform(-1, 1, 2)
    options = EditOptions(
        polish=int(rng.choice([0, 2])), depth_hold=float(rng.choice([0.0, 0.02, 1.0]))
    )
    level = float(rng.choice([0.0, 0.3, 1.0]))
    return SketchEdit(roi, level, (Stroke(anchors, view, target),), options)


def right_or_refused(mesh: Mesh, roi: I64, rng: np.random.Generator) -> str:
    """Return "right", or "refused" after a fact and a remedy."""
    try:
        edit = random_edit(mesh, roi, rng)
        result = edit.prepare(mesh).solve(edit.strokes)
    except EngineError as error:
        return "refused" if str(error).count(".") >= 2 else f"without a remedy: {error}"
    assert np.isfinite(result.vertices).all()
    assert np.isfinite(result.level_vertices).all()
    outside = np.setdiff1d(np.arange(mesh.n), roi)
    assert (result.vertices[outside] == mesh.vertices[outside]).all()
    assert result.target_error_px < 0.5
    return "right"


@pytest.mark.parametrize("kind", list(broken.KINDS))
def test_random_edits_of_broken_meshes_come_back_right_or_are_refused(kind: str) -> None:
    for seed in range(2):
        rng = np.random.default_rng(seed)
        mesh = broken.KINDS[kind](seed)
        told = right_or_refused(mesh, random_region(mesh, rng, 400), rng)
        assert told in ("right", "refused")


@pytest.mark.parametrize(
    "name", ["armadillo.obj", "boot.obj", "wingnut.obj", "fish.obj", "hand_closed.obj"]
)
def test_random_edits_of_real_meshes_come_back_right(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    rng = np.random.default_rng(3)
    for _ in range(3):
        assert right_or_refused(mesh, random_region(mesh, rng, 600), rng) == "right"
