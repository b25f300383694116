"""Regions: rims, what is held, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from bench import broken
from engine import Mesh, Region, RegionError
from tests.engine.surfaces import ball, flat, icosphere_like, interior


def test_rims_are_the_rings_around_the_region() -> None:
    mesh = icosphere_like(2000)
    region = Region(mesh, ball(mesh, 300))
    adjacency = mesh.topology.adjacency.toarray() > 0
    roi = np.zeros(mesh.n, dtype=bool)
    roi[region.roi] = True
    ring = adjacency[roi].any(axis=0) & ~roi
    second = adjacency[ring].any(axis=0) & ~roi & ~ring
    assert region.rim.tolist() == np.flatnonzero(ring).tolist()
    assert region.rim2.tolist() == np.flatnonzero(second).tolist()


def test_patch_gives_the_rows_of_the_whole_mesh() -> None:
    from engine import cotangent_stiffness, vertex_areas

    mesh = icosphere_like(2000, radius=5.0)
    region = Region(mesh, ball(mesh, 300))
    near = np.concatenate([region.roi, region.rim])
    ours = region.laplacian.stiffness[: len(near)].toarray()
    whole = cotangent_stiffness(mesh)[near].toarray()
    assert np.abs(ours - whole[:, region.patch]).max() < 1e-12
    assert np.abs(whole).sum() == pytest.approx(np.abs(ours).sum())
    areas = region.laplacian.areas[: len(near)] * region.scale**2
    assert areas == pytest.approx(vertex_areas(mesh)[near], rel=1e-12)


def test_order_repetition_and_masks_of_ids_do_not_matter() -> None:
    mesh = flat(400)
    ids = interior(mesh)
    shuffled = np.random.default_rng(0).permutation(np.concatenate([ids, ids[:20]]))
    mask = np.isin(np.arange(mesh.n), ids)
    assert Region(mesh, shuffled).roi.tolist() == ids.tolist()
    assert Region(mesh, mask).roi.tolist() == ids.tolist()


def test_open_borders_are_held_unless_freed() -> None:
    mesh = flat(400)
    chosen = np.flatnonzero(mesh.vertices[:, 0] < 0.5)
    border = mesh.topology.border_vertices[chosen]
    held = Region(mesh, chosen)
    freed = Region(mesh, chosen, free_borders=True)
    assert held.held.tolist() == chosen[border].tolist()
    assert "open borders" in held.report
    assert freed.roi.tolist() == chosen.tolist()


def test_nonmanifold_edges_are_held_even_when_borders_are_freed() -> None:
    mesh = broken.fins(0)
    region = Region(mesh, interior(mesh), free_borders=True)
    assert mesh.topology.nonmanifold_vertices.any()
    assert not mesh.topology.nonmanifold_vertices[region.roi].any()


def test_vertices_of_no_face_are_dropped_and_said() -> None:
    mesh = flat(400)
    lonely = Mesh(np.concatenate([mesh.vertices, [[5, 5, 5], [6, 6, 6]]]), mesh.faces)
    region = Region(lonely, np.concatenate([interior(mesh), [400, 401]]))
    assert region.roi.tolist() == interior(mesh).tolist()
    assert "2 chosen vertices belong to no face" in region.report


def test_that_another_laplacian_is_taken_is_said() -> None:
    mesh = flat(400)
    x = mesh.vertices.copy()
    inner = interior(mesh)
    x[inner, 1] = 0.5 + 1e-5 * (x[inner, 1] - 0.5)
    squeezed = Region(mesh.with_vertices(x), inner)
    assert "an intrinsic Delaunay Laplacian is used there" in squeezed.report
    assert Region(mesh, inner).report == ""


def test_whole_closed_part_is_refused_with_the_remedy() -> None:
    mesh = icosphere_like(300)
    with pytest.raises(RegionError, match=r"covers a whole part.*Leave some of the form outside"):
        Region(mesh, np.arange(mesh.n))
    assert Region(mesh, np.arange(mesh.n - 1)).m == mesh.n - 1


def test_one_whole_part_among_others_is_refused() -> None:
    a, b = icosphere_like(300), icosphere_like(60)
    both = Mesh(
        np.concatenate([a.vertices, b.vertices + 5]), np.concatenate([a.faces, b.faces + 300])
    )
    with pytest.raises(RegionError, match=r"1 of the region's 2 parts \(60 vertices\)"):
        Region(both, np.concatenate([ball(a, 100), 300 + np.arange(60)]))


@pytest.mark.parametrize(
    ("roi", "says"),
    [
        ([], "empty"),
        ([400], "does not have"),
        ([-1], "does not have"),
        ([0.5], "whole numbers"),
        ([0], "open border"),
    ],
)
def test_bad_choices_are_refused_in_words(roi: list[float], says: str) -> None:
    with pytest.raises(RegionError, match=says):
        Region(flat(400), np.asarray(roi))


def test_islands_and_loops() -> None:
    mesh = flat(2500)
    r = np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1)
    ring_and_island = np.flatnonzero((r < 0.1) | ((r > 0.2) & (r < 0.35)))
    assert Region(mesh, ring_and_island).m == len(ring_and_island)
