"""A stroke whose anchors lie on the outline: the outline itself meets the target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine import SketchEdit, Stroke, View, resample_target, silhouette_chain
from engine.contour import Contour, between, even_fit, reach_beyond
from tests.engine.shapes import camera, parallel, sphere

BALL = sphere(5)
# It ends soon behind the outline, so the flank before it bulges out.
ROI = np.flatnonzero((BALL.vertices[:, 1] > -0.3) & (BALL.vertices[:, 0] > -0.25))
FAR = camera((9.0, 0.0, 0.0))
VIEWS = [pytest.param(FAR, id="perspective"), pytest.param(parallel(0), id="parallel")]


def outline_arc(view: View, swell: float) -> np.ndarray:
    """A path along the ball's outline around +y, its middle `swell` px further out."""
    seen = view.project(BALL.vertices)
    middle, radius = seen.mean(axis=0), np.ptp(seen[:, 1]) / 2
    out = view.project(np.array([[0.0, 1.0, 0.0]]))[0] - middle
    angle = np.linspace(-0.7, 0.7, 80) + np.arctan2(out[1], out[0])
    r = radius + swell * np.cos(np.linspace(-np.pi / 2, np.pi / 2, 80)) ** 2
    return middle + r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def bulged(view: View, swell: float, *, outline: bool) -> Stroke:
    chain = silhouette_chain(BALL, outline_arc(view, 0.0), view, ROI)
    assert chain is not None
    target = resample_target(BALL.vertices[chain], outline_arc(view, swell), view)
    return Stroke(chain, view, target, outline=outline)


def off_target(view: View, vertices: np.ndarray, swell: float) -> float:
    """How far the outline of the ball is off the drawn arc, px in the mean square.

    The ball's edges are 13 to 20 px long, so its corners alone stand half a pixel off any curve.
    """
    path = outline_arc(view, swell)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    # Whatever way the normals point: both outermost and innermost crossing are the same here.
    middle = view.project(BALL.vertices).mean(axis=0)
    normals *= np.sign(((path - middle) * normals).sum(axis=1))[:, None]
    lines = Contour.of(BALL, ROI).lines(view, vertices)
    off = reach_beyond(lines, path, normals, np.full(len(path), 60.0))[8:-8]
    assert np.isfinite(off).all()
    return float(np.sqrt((off**2).mean()))


@pytest.mark.parametrize("view", VIEWS)
def test_the_outline_meets_the_target_and_not_only_its_anchors(view: View) -> None:
    swell = np.ptp(outline_arc(view, 0.0)[:, 1]) / 8
    stroke = bulged(view, swell, outline=True)
    of_anchors = replace(stroke, outline=False)
    edit = SketchEdit(ROI, 0.0, (stroke,)).prepare(BALL)
    plain = edit.solve((of_anchors,))
    met = edit.solve((stroke,))
    print(
        off_target(view, plain.level_vertices, swell),
        off_target(view, met.level_vertices, swell),
    )
    assert off_target(view, plain.level_vertices, swell) > 1.2, "there is something to mend"
    assert off_target(view, met.level_vertices, swell) < 0.5
    assert met.target_error_px < 0.5


@pytest.mark.parametrize("view", VIEWS)
def test_an_outline_that_shall_stay_moves_nothing(view: View) -> None:
    chain = silhouette_chain(BALL, outline_arc(view, 0.0), view, ROI)
    assert chain is not None
    here = view.project(BALL.vertices[chain])
    still = Stroke(chain, view, here, outline=True)
    result = SketchEdit(ROI, 1.0, (still,)).prepare(BALL).solve((still,))
    assert (result.vertices == BALL.vertices).all()


def test_half_the_way_is_half_the_way_of_the_outline() -> None:
    view, swell = FAR, 20.0
    stroke = bulged(view, swell, outline=True)
    edit = SketchEdit(ROI, 0.0, (stroke,))
    half = replace(edit, options=replace(edit.options, amount=0.5))
    moved = half.prepare(BALL).solve((stroke,)).level_vertices
    assert off_target(view, moved, swell / 2) < 0.5


def test_it_survives_its_recipe() -> None:
    stroke = bulged(parallel(0), 20.0, outline=True)
    assert stroke.to_json()["outline"] is True
    assert Stroke.from_json(stroke.to_json()).outline
    assert "outline" not in replace(stroke, outline=False).to_json()


def test_lines_are_measured_along_the_normals() -> None:
    curve = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    up = np.tile([0.0, 1.0], (3, 1))
    lines = np.array([[[-5.0, 2.0], [15.0, 4.0]], [[-5.0, -1.0], [15.0, -1.0]]])
    off = reach_beyond(lines, curve, up, np.full(3, 50.0))
    assert off[:2] == pytest.approx([2.5, 3.5])
    assert np.isnan(off[2])
    assert np.isnan(reach_beyond(lines, curve, up, np.full(3, 0.5))).all()


def test_a_strong_pull_is_met_between_the_anchors_too() -> None:
    """Pulled by a third of its length, to within half a pixel of what straight edges allow."""
    view = FAR
    swell = np.ptp(outline_arc(view, 0.0)[:, 1]) / 3
    stroke = bulged(view, swell, outline=True)
    met = SketchEdit(ROI, 0.0, (stroke,)).prepare(BALL).solve((stroke,))
    off = off_target(view, met.level_vertices, swell)
    plain = replace(stroke, outline=False)
    before = off_target(
        view, SketchEdit(ROI, 0.0, (plain,)).prepare(BALL).solve((plain,)).level_vertices, swell
    )
    print(off, before)
    assert off < 0.5 < before / 4
    assert met.target_error_px < 0.5


@pytest.mark.parametrize("closed", [False, True])
def test_between_anchors_a_curve_is_round(closed: bool) -> None:
    angle = np.linspace(0, 2 * np.pi if closed else np.pi, 24, endpoint=not closed)
    circle = 50 * np.column_stack([np.cos(angle), np.sin(angle)])
    dense = between(circle, closed)
    assert len(dense) == (4 * 24 if closed else 4 * 23 + 1)
    assert dense[::4] == pytest.approx(circle)
    assert np.abs(np.linalg.norm(dense, axis=1) - 50).max() < 0.05


@pytest.mark.parametrize("closed", [False, True])
def test_long_waves_are_followed_and_short_ones_left_out(closed: bool) -> None:
    c = 48
    q = 4 * c if closed else 4 * (c - 1) + 1
    fit = even_fit(c, q, closed)
    at, anchors = np.arange(q) / 4, np.arange(c)
    for wave, gain in ((48.0, 1.0), (4.0, 0.0)):
        given = np.cos(2 * np.pi * at / wave)
        got = fit @ given
        share = got @ np.cos(2 * np.pi * anchors / wave) / (c / 2)
        assert share == pytest.approx(gain, abs=0.06)
    assert fit @ np.ones(q) == pytest.approx(np.ones(c))
