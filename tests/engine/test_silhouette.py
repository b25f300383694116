"""The outline as a source curve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from engine import View, silhouette_chain
from engine.silhouette import outline_edges
from tests.engine.shapes import camera, parallel, plate, sphere

BALL = sphere(4)
EYE = np.array([5.0, 0.0, 0.0])
VIEWS = [
    pytest.param(camera(tuple(EYE)), id="perspective"),
    pytest.param(parallel(0), id="parallel"),
]


def arc(view: View, low: float, high: float, off: float = 0.0, n: int = 60) -> np.ndarray:
    """A stroke along the sphere's outline between two angles, `off` px outside it."""
    t = np.linspace(low, high, n)
    seen = view.project(BALL.vertices)
    radius = (np.ptp(seen[:, 1]) / 2) + off
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    return middle + radius * np.column_stack([np.cos(t), np.sin(t)])


@pytest.mark.parametrize("view", VIEWS)
def test_the_outline_of_a_sphere_is_its_circle_of_tangents(view: View) -> None:
    edges, outline, _ = outline_edges(BALL, view, np.arange(BALL.n))
    x = BALL.vertices[np.unique(edges[outline])]
    # From a point at distance d the tangents touch the unit sphere where x = 1 / d.
    where = 0.0 if view.depth(np.eye(3)).std() == 0 else 1 / EYE[0]
    edge = np.linalg.norm(BALL.vertices[edges[:, 0]] - BALL.vertices[edges[:, 1]], axis=1).max()
    assert np.abs(x[:, 0] - where).max() < edge
    assert outline.sum() > 40


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("off", [-15.0, 0.0, 15.0])
def test_a_stroke_beside_the_outline_gives_the_chain_along_it(view: View, off: float) -> None:
    path = arc(view, -0.9, 0.9, off)
    chain = silhouette_chain(BALL, path, view, np.arange(BALL.n))
    assert chain is not None
    pairs = {tuple(pair) for pair in np.sort(BALL.topology.edges, axis=1).tolist()}
    steps = np.sort(np.column_stack([chain[:-1], chain[1:]]), axis=1)
    assert all(tuple(step) in pairs for step in steps.tolist()), "a chain of edges"
    assert len(np.unique(chain)) == len(chain)
    seen = view.project(BALL.vertices[chain])
    # The ball's triangles stand off its circle by up to two pixels.
    assert cKDTree(arc(view, -1.0, 1.0, n=2000)).query(seen)[0].max() < 3.0, "on the outline"
    edge_px = np.linalg.norm(np.diff(seen, axis=0), axis=1).max()
    assert np.linalg.norm(seen[[0, -1]] - arc(view, -0.9, 0.9)[[0, -1]], axis=1).max() < edge_px + 2


@pytest.mark.parametrize("view", VIEWS)
def test_the_chain_does_not_zigzag_in_depth(view: View) -> None:
    turn = Rotation.from_rotvec([0.3, 0.7, 0.4]).as_matrix()
    turned = BALL.with_vertices(BALL.vertices @ turn.T)
    chain = silhouette_chain(turned, arc(view, -0.9, 0.9), view, np.arange(BALL.n))
    assert chain is not None
    x = turned.vertices[chain]
    angle = np.arccos(np.clip(x[0] @ x[-1], -1, 1))
    along = np.linalg.norm(np.diff(x, axis=0), axis=1).sum()
    assert along < 1.2 * angle, (
        "the edges between what is seen and what is not are half as long again"
    )


def test_a_closed_stroke_goes_all_the_way_round() -> None:
    view = parallel(0)
    chain = silhouette_chain(BALL, arc(view, 0, 2 * np.pi), view, np.arange(BALL.n), closed=True)
    assert chain is not None
    x = BALL.vertices[chain]
    angles = np.sort(np.arctan2(x[:, 2], x[:, 1]))
    assert np.diff(np.append(angles, angles[0] + 2 * np.pi)).max() < 0.3
    assert chain[0] != chain[-1]


def test_a_stroke_across_the_middle_is_no_outline() -> None:
    view = parallel(0)
    middle = view.project(np.zeros((1, 3)))[0]
    path = middle + np.column_stack([np.linspace(-80, 80, 30), np.zeros(30)])
    assert silhouette_chain(BALL, path, view, np.arange(BALL.n)) is None


def test_what_is_hidden_is_no_outline() -> None:
    view = parallel(0)
    path = arc(view, -0.9, 0.9)
    everything = np.arange(BALL.n)
    assert silhouette_chain(BALL, path, view, everything, visible=np.zeros(0, np.int64)) is None
    front = np.flatnonzero(BALL.vertices[:, 0] > 0)
    assert silhouette_chain(BALL, path, view, everything, visible=front) is not None


def test_an_open_border_is_an_outline() -> None:
    sheet = plate(15)
    view = parallel(2)
    seen = view.project(sheet.vertices)
    low = np.flatnonzero(sheet.vertices[:, 1] == 0)
    low = low[np.argsort(sheet.vertices[low, 0])]
    path = seen[low[2:-2]]
    chain = silhouette_chain(sheet, path, view, np.arange(sheet.n))
    assert chain is not None
    assert chain.tolist() in (low[2:-2].tolist(), low[2:-2][::-1].tolist())


def test_it_keeps_to_the_region() -> None:
    view = parallel(0)
    roi = np.flatnonzero(BALL.vertices[:, 1] > 0.2)
    chain = silhouette_chain(BALL, arc(view, -0.9, 0.9), view, roi)
    assert chain is not None
    assert np.isin(chain, roi).all()
