"""What the built-in edit tools beyond the sketch do to a form."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Cancelled, Mesh, MeshError, Run, Step, vertex_areas
from plugins.equaliser import EqualiserStep
from plugins.inflate import InflateStep
from plugins.registry import find_steps, find_tools
from plugins.remesh import RemeshStep
from plugins.smooth import SmoothStep


@pytest.fixture(scope="module")
def wavy() -> Mesh:
    """A 60 x 60 mm plate with irregular triangles, a broad wave and a fine one."""
    rng = np.random.default_rng(3)
    side = 41
    u, v = np.meshgrid(np.linspace(0, 60, side), np.linspace(0, 60, side), indexing="ij")
    x = np.column_stack([u.ravel(), v.ravel()])
    inner = ((x > 0) & (x < 60)).all(axis=1)
    x[inner] += rng.uniform(-0.35, 0.35, (inner.sum(), 2))
    z = 2 * np.sin(np.pi * x[:, 0] / 15) + 0.4 * np.sin(np.pi * x[:, 1] / 3)
    i, j = np.meshgrid(np.arange(side - 1), np.arange(side - 1), indexing="ij")
    a = (i * side + j).ravel()
    quads = np.column_stack([a, a + side, a + side + 1, a + 1])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(np.column_stack([x, z]), faces)


@pytest.fixture(scope="module")
def roi(wavy: Mesh) -> np.ndarray:
    x = wavy.vertices
    return np.flatnonzero(((x[:, :2] > 8) & (x[:, :2] < 52)).all(axis=1))


def bending(mesh: Mesh, ids: np.ndarray) -> float:
    """Area-weighted mean square of the Laplacian coordinates."""
    from engine import cotangent_stiffness

    areas = vertex_areas(mesh)
    delta = (cotangent_stiffness(mesh) @ mesh.vertices) / areas[:, None]
    return float((areas[ids] @ (delta[ids] ** 2).sum(axis=1)) / areas[ids].sum())


def steps(roi: np.ndarray) -> list[Step]:
    return [
        SmoothStep(roi, 0.0, 0.7),
        EqualiserStep(roi, (16.0, 8.0), (1.0, 1.5, 0.2)),
        InflateStep(roi, 3.0, 0.5),
    ]


def test_only_the_region_moves_and_the_faces_are_the_same_object(
    wavy: Mesh, roi: np.ndarray
) -> None:
    outside = np.setdiff1d(np.arange(wavy.n), roi)
    for step in steps(roi):
        changed = step.apply(wavy)
        assert changed.faces is wavy.faces
        assert (changed.vertices[outside] == wavy.vertices[outside]).all()
        assert np.abs(changed.vertices[roi] - wavy.vertices[roi]).max() > 0.1


def test_a_recipe_brings_back_the_same_bits(wavy: Mesh, roi: np.ndarray) -> None:
    for step in steps(roi):
        again = type(step).from_json(step.to_json())
        assert (again.apply(wavy).vertices == step.apply(wavy).vertices).all()


def test_smoothing_smooths_and_amount_zero_does_nothing(wavy: Mesh, roi: np.ndarray) -> None:
    before = bending(wavy, roi)
    half = bending(SmoothStep(roi, 0.0, 0.5).apply(wavy), roi)
    whole = bending(SmoothStep(roi, 0.0, 1.0).apply(wavy), roi)
    assert whole < 0.05 * before < half < 0.5 * before
    assert (SmoothStep(roi, 0.0, 0.0).apply(wavy).vertices == wavy.vertices).all()


def test_smoothing_to_level_one_leaves_the_original(wavy: Mesh, roi: np.ndarray) -> None:
    changed = SmoothStep(roi, 1.0, 1.0).apply(wavy)
    assert np.abs(changed.vertices - wavy.vertices).max() < 1e-9 * wavy.diagonal


def test_gains_of_one_change_nothing_and_of_zero_give_the_base(wavy: Mesh, roi: np.ndarray) -> None:
    same = EqualiserStep(roi, (16.0, 8.0), (1.0, 1.0, 1.0)).apply(wavy)
    assert np.abs(same.vertices - wavy.vertices).max() < 1e-9 * wavy.diagonal
    none = EqualiserStep(roi, (16.0, 8.0), (0.0, 0.0, 0.0)).apply(wavy)
    base = SmoothStep(roi, 0.0, 1.0).apply(wavy)
    assert np.abs(none.vertices - base.vertices).max() < 1e-9 * wavy.diagonal


def test_the_equaliser_removes_the_fine_wave_and_keeps_the_broad_one(
    wavy: Mesh, roi: np.ndarray
) -> None:
    changed = EqualiserStep(roi, (12.0,), (1.0, 0.0)).apply(wavy)
    x = wavy.vertices
    core = np.flatnonzero(((x[:, :2] > 18) & (x[:, :2] < 42)).all(axis=1))
    fine, broad = np.sin(np.pi * x[core, 1] / 3), np.sin(np.pi * x[core, 0] / 15)
    waves = np.column_stack([fine, broad, np.ones(len(core))])
    before = np.linalg.lstsq(waves, x[core, 2], rcond=None)[0]
    after = np.linalg.lstsq(waves, changed.vertices[core, 2], rcond=None)[0]
    assert abs(after[0]) < 0.1 * before[0]
    assert after[1] > 0.9 * before[1]


def test_each_gain_is_that_of_its_band(wavy: Mesh, roi: np.ndarray) -> None:
    """The bands add up: what every gain alone leaves is together what there is."""
    sizes = (16.0, 8.0, 5.0)
    base = SmoothStep(roi, 0.0, 1.0).apply(wavy).vertices
    alone = []
    for band in range(4):
        gains = tuple(float(i == band) for i in range(4))
        alone.append(EqualiserStep(roi, sizes, gains).apply(wavy).vertices - base)
    assert np.abs(base + sum(alone) - wavy.vertices).max() < 1e-9 * wavy.diagonal
    # A wave is 6 mm long, the other 30 mm: in the third band and in the first.
    across = np.sin(np.pi * wavy.vertices[:, 1] / 3)
    share = [abs(float(part[:, 2] @ across)) for part in alone]
    assert np.argmax(share) == 2
    assert share[2] > 3 * share[3]


def test_a_cancelled_step_stops_where_the_region_is_taken_apart(
    wavy: Mesh, roi: np.ndarray
) -> None:
    run = Run()
    run.cancel()
    for step in steps(roi)[:2]:
        with pytest.raises(Cancelled):
            step.apply(wavy, run)


def test_inflating_lifts_the_middle_by_the_distance(wavy: Mesh, roi: np.ndarray) -> None:
    move = np.linalg.norm(InflateStep(roi, 3.0).apply(wavy).vertices - wavy.vertices, axis=1)
    assert 2.9 < move.max() <= 3.0 + 1e-12
    rim = np.flatnonzero(wavy.topology.adjacency @ np.isin(np.arange(wavy.n), roi, invert=True))
    assert move[np.intersect1d(rim, roi)].max() < 0.1 * 3.0


def test_remeshing_evens_the_triangles_and_keeps_everything_outside(
    wavy: Mesh, roi: np.ndarray
) -> None:
    changed = RemeshStep(roi, 1.0).apply(wavy)
    outside = np.setdiff1d(np.arange(wavy.n), roi)
    kept = {row.tobytes() for row in changed.vertices}
    assert all(row.tobytes() in kept for row in wavy.vertices[outside])
    assert changed.n > 1.3 * wavy.n
    assert (changed.topology.edge_face_counts <= 2).all()
    border = changed.topology.border_vertices.sum()
    assert border == wavy.topology.border_vertices.sum()


def test_remeshing_refuses_absurd_lengths(wavy: Mesh, roi: np.ndarray) -> None:
    with pytest.raises(MeshError, match="Choose one above"):
        RemeshStep(roi, 1e-6).apply(wavy)
    with pytest.raises(MeshError, match="too thin"):
        RemeshStep(roi[:5], 1.0).apply(wavy)


def test_every_edit_tool_has_its_step_found(roi: np.ndarray) -> None:
    kinds = find_steps()
    tools = find_tools()
    assert not kinds.failures
    assert not tools.failures
    for step in steps(roi):
        assert kinds.items[step.kind] is type(step)
        assert step.kind in tools.items
