"""Symmetrise: one side mirrored, the kept side untouched, regions fading out at their rim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engine import (
    Cancelled,
    Document,
    EngineError,
    Mesh,
    Run,
    closest_points,
    drag_patch,
    reflected,
)
from engine.measure import rim_dihedral
from plugins.symmetrise import (
    ANY_SIDE,
    NO_REGION,
    Symmetrise,
    SymmetriseOptions,
    SymmetriseStep,
    edited_side,
    fitting_plane,
)
from tests.app.driving import bumpy_sphere
from tests.plugins.flat import FlatContext

ACROSS_X = (1.0, 0.0, 0.0, 0.0)


def asymmetry(mesh: Mesh, plane: tuple[float, ...]) -> np.ndarray:
    """Distances of the mirrored vertices to the surface, (n,)."""
    return closest_points(mesh, reflected(mesh.vertices, plane)).distances


@pytest.fixture(scope="module")
def dented() -> Mesh:
    """A bumpy sphere about the origin with a horn on its right side."""
    sphere = bumpy_sphere()
    x = sphere.vertices - sphere.bounds.mean(axis=0)
    sphere = Mesh(x, sphere.faces)
    tip = x[x[:, 0].argmax()]
    away = np.linalg.norm(x - tip, axis=1) / np.linalg.norm(tip)
    M = np.eye(4)
    M[:3, 3] = 0.35 * tip
    return drag_patch(sphere, np.flatnonzero(away < 0.8), np.flatnonzero(away < 0.2), M)


@pytest.mark.parametrize("keep", [(1.0, 0.0, 0.0), (-2.0, 0.5, 0.0)])
def test_the_other_side_becomes_the_mirror_image(dented: Mesh, keep: tuple[float, ...]) -> None:
    after = SymmetriseStep(NO_REGION, ACROSS_X, keep).apply(dented)
    side = dented.vertices[:, 0] * np.sign(keep[0])
    assert after.faces is dented.faces
    assert (after.vertices[side >= 0] == dented.vertices[side >= 0]).all()
    before, now = asymmetry(dented, ACROSS_X), asymmetry(after, ACROSS_X)
    assert before.max() > 0.05 * dented.diagonal
    assert np.percentile(now, 99) < 0.004 * dented.diagonal
    assert np.sqrt((now**2).mean()) < 0.05 * np.sqrt((before**2).mean())
    reach = np.ptp(after.vertices[:, 0]) / 2
    assert reach == pytest.approx(side.max(), rel=0.02), "as far on both sides"
    across = np.sign(keep[0]) * after.vertices[side < 0, 0]
    assert across.max() <= 1e-9 * dented.diagonal, "nothing of the image reaches over the plane"
    # Nothing is turned over or squeezed to nothing.
    size = np.linalg.norm(after.face_normals, axis=1)
    assert size.min() > 0.01 * np.median(size)


def test_a_symmetric_form_stays_and_doing_it_twice_adds_nothing(dented: Mesh) -> None:
    once = SymmetriseStep(NO_REGION, ACROSS_X).apply(dented)
    twice = SymmetriseStep(NO_REGION, ACROSS_X).apply(once)
    moved = np.linalg.norm(twice.vertices - once.vertices, axis=1)
    assert np.percentile(moved, 99) < 0.02 * dented.diagonal
    assert asymmetry(twice, ACROSS_X).mean() < 0.002 * dented.diagonal


def test_the_scale_of_the_normal_does_not_matter(dented: Mesh) -> None:
    turned = Mesh(dented.vertices + np.array([5.0, -3.0, 2.0]), dented.faces)
    run = Run()
    given = SymmetriseStep(NO_REGION, (3.0, 0.0, 0.0, 15.0)).apply(turned, run)
    unit = SymmetriseStep(NO_REGION, (1.0, 0.0, 0.0, 5.0)).apply(turned, run)
    assert given.vertices == pytest.approx(unit.vertices, abs=1e-12)


def test_an_edit_on_one_side_does_not_pull_the_plane_along() -> None:
    rng = np.random.default_rng(4)
    egg = bumpy_sphere(bumps=0.0)
    x = egg.vertices * [1.0, 1.6, 0.7]
    x[:, 0] *= 1 + 0.006 * x[:, 1]
    x[:, 2] += 25 * (x[:, 1] / 80) ** 2  # bent like a banana: one plane of symmetry is left
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    egg = Mesh(x @ turn.T + [7.0, 8.0, 9.0], egg.faces)
    tip = egg.vertices[x[:, 0].argmax()]
    away = np.linalg.norm(egg.vertices - tip, axis=1)
    M = np.eye(4)
    M[:3, 3] = 20 * turn[:, 0]
    horn = drag_patch(egg, np.flatnonzero(away < 30), np.flatnonzero(away < 8), M)
    plane = np.array(fitting_plane(horn))
    assert abs(plane[:3] @ turn[:, 0]) > np.cos(np.radians(0.5))
    middle = np.array([7.0, 8.0, 9.0])
    assert abs(plane[:3] @ middle - plane[3]) < 0.003 * egg.diagonal
    shift = 300 * egg.diagonal * np.array([1.0, -2.0, 0.5])
    far = np.array(fitting_plane(Mesh(horn.vertices + shift, horn.faces)))
    assert far[:3] == pytest.approx(plane[:3], abs=1e-6), "wherever the model stands"
    assert far[3] - far[:3] @ shift == pytest.approx(plane[3], abs=1e-6 * egg.diagonal)


def test_a_region_fades_out_at_its_rim(dented: Mesh) -> None:
    x = dented.vertices
    left = x[x[:, 0].argmin()]
    roi = np.flatnonzero(np.linalg.norm(x - left, axis=1) < 0.9 * np.linalg.norm(left))
    step = SymmetriseStep(roi, ACROSS_X, fade=0.6)
    after = step.apply(dented)
    outside = np.setdiff1d(np.arange(dented.n), roi)
    assert (after.vertices[outside] == x[outside]).all()
    assert rim_dihedral(after, roi) < rim_dihedral(dented, roi) + np.radians(3)
    whole = SymmetriseStep(NO_REGION, ACROSS_X).apply(dented)
    middle = x[:, 0].argmin()
    assert after.vertices[middle] == pytest.approx(whole.vertices[middle])
    again = SymmetriseStep.from_json(step.to_json())
    assert (again.apply(dented).vertices == after.vertices).all()
    everything = SymmetriseStep.from_json(SymmetriseStep(NO_REGION, ACROSS_X).to_json())
    assert (everything.apply(dented).vertices == whole.vertices).all()


def test_what_cannot_be_is_told(dented: Mesh) -> None:
    right = np.flatnonzero(dented.vertices[:, 0] > 0.1 * dented.diagonal)
    with pytest.raises(EngineError, match="side that is kept"):
        SymmetriseStep(right, ACROSS_X).apply(dented)
    with pytest.raises(EngineError, match="Nothing lies"):
        SymmetriseStep(NO_REGION, (1.0, 0.0, 0.0, 1e6)).apply(dented)
    with pytest.raises(EngineError, match="does not divide"):
        SymmetriseStep(NO_REGION, ACROSS_X, (0.0, 0.0, 1.0)).apply(dented)
    for keep in ((0.0, 0.0, 0.0), (1.0, 0.0)):
        with pytest.raises(EngineError, match="three numbers"):
            SymmetriseStep(NO_REGION, ACROSS_X, keep).apply(dented)
    with pytest.raises(EngineError, match="four numbers"):
        SymmetriseStep(NO_REGION, (0.0, 0.0, 0.0, 1.0)).apply(dented)


def test_the_tool_gives_the_step_for_its_options(dented: Mesh) -> None:
    tool, context = Symmetrise(), FlatContext(Document.open(dented))
    context.options = SymmetriseOptions()
    assert tool.enter(context).plane == ()
    assert "the model" in tool.hint(context.document)
    document = context.document
    chosen = document.with_draft(document.draft.with_roi(np.arange(40)))
    assert "the region" in tool.hint(chosen)
    context.options = SymmetriseOptions(keep="front", plane="middle")
    step = tool.enter(context)
    assert step.plane == pytest.approx((0, 1, 0, dented.bounds.mean(axis=0)[1]))
    assert step.keep == (0, -1, 0), "the front stays"
    assert len(step.roi) == 0
    assert list(tool.gesture(context, None)) == []


def test_the_side_that_was_edited_is_kept(dented: Mesh) -> None:
    x = dented.vertices
    assert (edited_side(Document.open(dented)) == ANY_SIDE).all()
    left = x[:, 0] < np.quantile(x[:, 0], 0.1)
    pushed = dented.with_vertices(np.where(left[:, None], 1.1, 1.0) * x)
    document = replace(Document.open(dented), mesh=pushed)
    context = FlatContext(document)
    context.options = SymmetriseOptions(plane="middle")
    step = Symmetrise().enter(context)
    after = step.apply(pushed)
    assert (after.vertices[left] == pushed.vertices[left]).all(), "what was edited stays"
    assert step.keep[0] < 0


def test_it_says_how_far_it_is_and_stops_when_asked(dented: Mesh) -> None:
    told: list[tuple[str, float]] = []
    SymmetriseStep(NO_REGION).apply(dented, Run(lambda share, words: told.append((words, share))))
    words = list(dict.fromkeys(word for word, _ in told))
    assert len(words) == 3, "the plane is found, fitted, and then the image"
    for word in words:
        shares = [share for known, share in told if known == word]
        assert len(shares) > 5
        assert shares[0] == 0.0
        assert shares == sorted(shares)
        assert shares[-1] <= 1.0
    for plane in ((), ACROSS_X):
        stopped = Run()
        stopped.cancel()
        with pytest.raises(Cancelled):
            SymmetriseStep(NO_REGION, plane).apply(dented, stopped)
