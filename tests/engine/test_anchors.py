"""Anchors: simple, connected, inside, covering the stroke (Fig. 9); gaps, loops, noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import Mesh, SketchError, anchor_path, trace_anchors
from engine.anchors import AnchorPath
from engine.arrays import F64, I64

from .shapes import camera, faces_along, inner, parallel, plate, sphere

TOP = camera((0.5, 0.5, 3.0), (0.5, 0.5, 0.0), (0, 1, 0))
PLATE = plate(30, wave=0.02)


def stroke(points: list[tuple[float, float]], count: int = 80) -> F64:
    """Pixels of a smooth curve through points of the plate, seen in TOP."""
    at = np.linspace(0, 1, len(points))
    t = np.linspace(0, 1, count)
    x = np.column_stack([np.interp(t, at, column) for column in np.array(points).T])
    return TOP.project(np.column_stack([x, np.zeros(count)]))


def is_chain(mesh: Mesh, chain: I64, closed: bool = False) -> bool:
    edges = {tuple(e) for e in mesh.topology.edges.tolist()}
    after = np.roll(chain, -1) if closed else chain[1:]
    steps = zip(chain if closed else chain[:-1], after, strict=True)
    joined = all((min(a, b), max(a, b)) in edges for a, b in steps)
    return joined and len(np.unique(chain)) == len(chain)


def traced(path: F64, mesh: Mesh = PLATE, roi: I64 | None = None) -> AnchorPath:
    return trace_anchors(mesh, faces_along(mesh, TOP, path), path, TOP, roi)


@settings(max_examples=40, deadline=None)
@given(
    points=st.lists(st.tuples(st.floats(0.05, 0.95), st.floats(0.05, 0.95)), min_size=2, max_size=3)
)
def test_chains_are_simple_connected_and_cover(points: list[tuple[float, float]]) -> None:
    if np.abs(np.diff(np.array(points), axis=0)).max() < 0.1:
        return
    path = stroke(points)
    found = traced(path)
    assert is_chain(PLATE, found.anchors)
    # A stroke that turns back over itself is cut short, and says so by its coverage.
    straight = len(points) == 2
    assert found.coverage >= (0.95 if straight else 0.0)
    assert 0.0 <= found.coverage <= 1.0


def test_the_chain_stays_within_an_edge_of_the_stroke_and_ends_at_its_ends() -> None:
    path = stroke([(0.1, 0.2), (0.5, 0.45), (0.9, 0.8)])
    chain = traced(path).anchors
    seen = TOP.project(PLATE.vertices[chain])
    edge = np.linalg.norm(np.diff(seen, axis=0), axis=1).max()
    away = np.linalg.norm(seen[:, None] - path, axis=2).min(axis=1)
    assert away.max() < edge
    assert np.linalg.norm(seen[[0, -1]] - path[[0, -1]], axis=1).max() < edge


def test_it_is_not_longer_than_a_zigzag_must_be() -> None:
    chain = traced(stroke([(0.1, 0.5), (0.9, 0.5)])).anchors
    x = PLATE.vertices[chain]
    assert np.linalg.norm(np.diff(x, axis=0), axis=1).sum() < 1.25 * 0.8


def test_the_chain_keeps_to_the_region() -> None:
    roi = inner(PLATE, 0.3, 0.7)
    found = traced(stroke([(0.05, 0.3), (0.95, 0.7)]), roi=roi)
    assert np.isin(found.anchors, roi).all()
    assert is_chain(PLATE, found.anchors)
    assert len(found.anchors) > 8


def test_gaps_are_bridged_on_the_surface() -> None:
    path = stroke([(0.1, 0.4), (0.9, 0.6)])
    faces = faces_along(PLATE, TOP, path)
    some = faces[:: len(faces) // 12]
    found = trace_anchors(PLATE, some, path, TOP)
    assert found.bridged > 3
    assert found.coverage == 1.0
    assert is_chain(PLATE, found.anchors)
    whole = traced(path)
    assert len(found.anchors) <= 1.6 * len(whole.anchors)


def test_a_gap_as_wide_as_the_stroke_goes_the_shortest_way() -> None:
    path = stroke([(0.1, 0.5), (0.9, 0.5)])
    faces = faces_along(PLATE, TOP, path)
    found = trace_anchors(PLATE, np.array([faces[0], faces[-1]]), path, TOP)
    assert found.bridged == 1
    assert is_chain(PLATE, found.anchors)


def test_flicker_and_repeats_do_no_harm() -> None:
    path = stroke([(0.1, 0.3), (0.9, 0.6)])
    faces = faces_along(PLATE, TOP, path)
    shaken = np.repeat(faces, 2)
    shaken[2:-2:5] = shaken[4::5][: len(shaken[2:-2:5])]
    found = trace_anchors(PLATE, shaken, path, TOP)
    assert is_chain(PLATE, found.anchors)
    assert found.coverage >= 0.95


def test_a_loop_closes() -> None:
    t = np.linspace(0, 2 * np.pi, 120)
    ring = np.column_stack([0.5 + 0.3 * np.cos(t), 0.5 + 0.3 * np.sin(t), 0 * t])
    path = TOP.project(ring)
    found = trace_anchors(PLATE, faces_along(PLATE, TOP, path), path, TOP, closed=True)
    assert is_chain(PLATE, found.anchors, closed=True)
    assert found.coverage >= 0.95
    assert len(found.anchors) > 30


def test_the_same_in_a_parallel_projection_on_a_sphere() -> None:
    ball, view = sphere(4), parallel(2, scale=1.3)
    t = np.linspace(-0.8, 0.8, 60)
    path = view.project(np.column_stack([t, 0.3 * np.sin(2 * t), 0 * t]))
    found = trace_anchors(ball, faces_along(ball, view, path), path, view)
    assert is_chain(ball, found.anchors)
    assert found.coverage >= 0.95


def test_one_triangle_is_enough() -> None:
    path = stroke([(0.5, 0.5), (0.52, 0.5)])
    face = faces_along(PLATE, TOP, path)[:1]
    found = trace_anchors(PLATE, face, path, TOP)
    assert 1 <= len(found.anchors) <= 3
    assert found.coverage == 1.0


@pytest.mark.parametrize("count", [1, 2])
def test_a_loop_within_a_triangle_or_two_is_refused(count: int) -> None:
    face = PLATE.faces[[300]]
    beside = PLATE.faces[(np.isin(PLATE.faces, face).sum(axis=1) == 2)][:1]
    across = np.concatenate([face, beside])[:count]
    middles = PLATE.vertices[across].mean(axis=1)
    t = np.linspace(0, 2 * np.pi, 40)
    ring = middles.mean(axis=0) + 0.002 * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    faces = np.flatnonzero((PLATE.faces[:, None] == across).all(axis=2).any(axis=1))
    with pytest.raises(SketchError, match="smaller than the triangles"):
        trace_anchors(PLATE, faces, TOP.project(ring), TOP, closed=True)


def test_what_cannot_be_a_source_is_refused() -> None:
    path = stroke([(0.1, 0.3), (0.9, 0.6)])
    with pytest.raises(SketchError, match="does not touch the region"):
        anchor_path(PLATE, np.zeros(0, dtype=np.int64), path, TOP)
    with pytest.raises(SketchError, match="another mesh"):
        anchor_path(PLATE, np.array([10**6]), path, TOP)
    with pytest.raises(SketchError, match="only a point"):
        anchor_path(PLATE, np.array([3]), path[:1], TOP)
    two = Mesh(
        np.vstack([PLATE.vertices, PLATE.vertices + np.array([2, 0, 0])]),
        np.vstack([PLATE.faces, PLATE.faces + PLATE.n]),
    )
    apart = np.array([10, len(PLATE.faces) + 10])
    with pytest.raises(SketchError, match="not connected"):
        anchor_path(two, apart, path, TOP, closed=True)


def test_over_two_parts_a_stroke_lies_on_that_with_most_of_it() -> None:
    gap = 1.1
    two = Mesh(
        np.vstack([PLATE.vertices, PLATE.vertices + np.array([gap, 0, 0])]),
        np.vstack([PLATE.faces, PLATE.faces + PLATE.n]),
    )
    for low, high, first in ((0.2, 1.3, True), (0.7, 2.0, False)):
        path = stroke([(low, 0.5), (high, 0.5)])
        left = faces_along(PLATE, TOP, stroke([(low, 0.5), (0.97, 0.5)]))
        right = faces_along(PLATE, TOP, stroke([(0.03, 0.5), (high - gap, 0.5)]))
        under = np.concatenate([left, right + len(PLATE.faces)])
        found = trace_anchors(two, under, path, TOP)
        assert found.parted
        assert is_chain(two, found.anchors)
        assert ((found.anchors < PLATE.n) == first).all()
        ends = two.vertices[found.anchors[[0, -1]], 0]
        assert ends == pytest.approx([low, 0.97] if first else [gap + 0.03, high], abs=0.06)
        assert found.coverage < 1.0
    one = trace_anchors(PLATE, left, stroke([(0.7, 0.5), (0.97, 0.5)]), TOP)
    assert not one.parted
