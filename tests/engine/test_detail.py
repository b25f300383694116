"""Base plus modes plus rest, the level of detail, and what must not change the answer."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from engine import (
    Mesh,
    cotangent_stiffness,
    decompose,
    decompose_stream,
    decompose_until,
    vertex_areas,
)
from engine import decomposition as decomposition_module
from engine.detail import CHUNK, Decomposition
from engine.level import Curve, cutoff_curvature, next_knot
from engine.lowpass import lowpass, step
from engine.run import Run
from tests.engine.surfaces import ball, flat, icosphere_like, interior, lifted


def _wavy(n: int = 1600) -> Mesh:
    mesh = flat(n)
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    waves = 0.02 * np.sin(18 * x) * np.sin(15 * y) + 0.005 * np.sin(50 * x + 3) * np.sin(45 * y)
    return lifted(mesh, 0.1 * np.sin(3 * x) + waves)


def _disc(mesh: Mesh, radius: float = 0.4) -> np.ndarray:
    return np.flatnonzero(np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1) < radius)


@pytest.fixture(scope="module")
def wavy() -> Decomposition:
    mesh = _wavy()
    return decompose(mesh, _disc(mesh))


def _whole(parts: Decomposition, roi_positions: np.ndarray) -> np.ndarray:
    x = parts.region.mesh.vertices.copy()
    x[parts.roi] = roi_positions
    return x


@pytest.mark.parametrize("rim", ["smooth", "paper"])
@pytest.mark.parametrize("k", [0, 1, 30, 200])
def test_surface_is_the_laplacian_reconstruction(rim: str, k: int) -> None:
    mesh = _wavy()
    parts = decompose(mesh, _disc(mesh), rim=rim)
    K, M = cotangent_stiffness(mesh), vertex_areas(mesh)
    delta = lambda x: (K @ x) / M[:, None]  # noqa: E731
    roi, m = parts.roi, parts.m
    residual = (delta(mesh.vertices) - delta(_whole(parts, parts.base)))[roi]
    phi = parts.modes[:, :k]
    low = phi @ (phi.T @ (M[roi, None] * residual))
    inner = K[roi][:, roi].toarray()
    solved = parts.base + np.linalg.solve(inner, M[roi, None] * low)
    assert np.abs(parts.surface(k) - solved).max() < 1e-12
    assert np.abs(delta(_whole(parts, parts.surface(k)))[roi] - parts.delta(k)).max() < 1e-8
    assert np.abs(parts.delta_residual - residual).max() < 1e-8
    # Low and high make up the residual.
    assert np.abs(low + parts.high(k) - residual).max() < 1e-8
    assert parts.k == m


def test_coefficients_do_not_depend_on_how_many_there_are(wavy: Decomposition) -> None:
    mesh = wavy.region.mesh
    few = decompose(mesh, wavy.roi, modes=40)
    assert (few.eta == wavy.eta[:40]).all()
    assert (
        np.abs(wavy.modes.T @ (wavy.areas[:, None] * wavy.delta_residual) - wavy.eta).max() < 1e-8
    )


def test_all_modes_give_the_original_and_level_one_is_it_exactly(wavy: Decomposition) -> None:
    assert wavy.surface(wavy.m) is wavy.original
    assert (wavy.original == wavy.region.mesh.vertices[wavy.roi]).all()
    anchor, part = wavy._chunk(wavy.m)
    summed = anchor.surface + wavy.modes[:, part] @ (wavy.eta[part] / wavy.eigenvalues[part, None])
    assert np.abs(summed - wavy.original).max() < 1e-12
    assert (wavy.surface(wavy.mode_count(1.0)) == wavy.original).all()
    assert (wavy.surface(wavy.mode_count(0.0)) == wavy.base).all()


def test_error_falls_with_the_number_of_modes(wavy: Decomposition) -> None:
    ks = [0, 10, 50, 100, 200, 400, wavy.m]
    # In the norm of M, where the modes are orthonormal, it cannot rise.
    error = [
        np.sqrt(np.sum(wavy.areas[:, None] * (wavy.surface(k) - wavy.original) ** 2)) for k in ks
    ]
    assert (np.diff(error) < 0).all()


def test_partial_sums_change_nothing(wavy: Decomposition) -> None:
    for k in (1, 31, 32, 33, 64, 100):
        c = wavy.eta[:k] / wavy.eigenvalues[:k, None]
        assert np.abs(wavy.surface(k) - (wavy.base + wavy.modes[:, :k] @ c)).max() < 1e-13


def test_details_go_back_exactly_where_nothing_was_edited(wavy: Decomposition) -> None:
    for k in (0, 20, 300):
        back = wavy.reconstruct(wavy.surface(k), wavy.high(k))
        assert np.abs(back - wavy.original).max() < 1e-12


def test_details_are_carried_rigidly(wavy: Decomposition) -> None:
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    # The rim is held at 0 for the details, so that turned details are those of the turned whole.
    back = wavy.reconstruct(wavy.surface(25) @ turn.T, wavy.high(25) @ turn.T)
    assert np.abs(back - wavy.original @ turn.T).max() < 1e-12


def test_levels_are_monotone_and_inverse_to_counts(wavy: Decomposition) -> None:
    levels = np.linspace(0, 1, 201)
    counts = [wavy.mode_count(level) for level in levels]
    assert counts[0] == 0
    assert counts[-1] == wavy.m
    assert (np.diff(counts) >= 0).all()
    assert wavy.mode_count(-1) == 0
    assert wavy.mode_count(2) == wavy.m
    assert wavy.mode_count(float("nan")) == 0
    for level, k in zip(levels, counts, strict=True):
        assert wavy.level_of(k) >= level - 1e-9
        assert k == 0 or wavy.level_of(k - 1) < level
    at = [wavy.level_of(k) for k in range(wavy.m + 1)]
    assert (np.diff(at) >= 0).all()


def test_level_follows_the_cutoff_curvature(wavy: Decomposition) -> None:
    low, full = wavy.cutoff(0), wavy.cutoff(wavy.m)
    assert full > 2 * low
    for level in (0.2, 0.5, 0.8):
        k = wavy.mode_count(level)
        wanted = low + level * (full - low)
        risen = np.maximum.accumulate(
            [cutoff_curvature(wavy.delta(i), wavy.areas) for i in range(k + 1)]
        )
        # Within the 1 % of the slider that counts modes and the 3 % between knots of the curve.
        slack = 0.04 * (full - low)
        assert risen[-1] >= wanted - slack
        assert risen[int(0.97 * k) - 1] <= wanted + slack


def test_cutoff_leaves_nine_tenths_of_the_area_below(wavy: Decomposition) -> None:
    for k in (0, 40, wavy.m):
        below = wavy.curvature(k) <= wavy.cutoff(k) * (1 + 1e-12)
        assert wavy.areas[below].sum() / wavy.areas.sum() == pytest.approx(0.9, abs=0.01)


def test_cutoff_curvature_of_a_sphere_is_that_of_the_sphere() -> None:
    mesh = icosphere_like(4000, 5.0, jitter=0.0)
    parts = decompose(mesh, ball(mesh, 800), modes=0)
    assert parts.cutoff(parts.m) == pytest.approx(0.2, rel=0.02)


def test_slider_is_monotone_on_a_curve_that_is_not() -> None:
    rng = np.random.default_rng(4)
    knots = [0]
    while knots[-1] < 500:
        knots.append(next_knot(knots[-1]))
    cut = np.linspace(1, 3, len(knots)) + 0.3 * rng.standard_normal(len(knots))
    curve = Curve.start(1.0, 3.0, 600).with_knots(knots[1:], cut[1:].tolist())
    counts = [curve.mode_count(level) for level in np.linspace(0, 1, 400)]
    assert (np.diff(counts) >= 0).all()


@pytest.mark.parametrize("full", [0.5, 1.0])
def test_a_region_without_features_still_has_a_slider(full: float) -> None:
    curve = Curve.start(1.0, full, 10).with_knots([3, 10], [0.9, full])
    counts = [curve.mode_count(level) for level in np.linspace(0, 1, 30)]
    assert counts[0] == 0
    assert counts[-1] == 10
    assert (np.diff(counts) >= 0).all()
    assert max(np.diff(counts)) <= 2


@pytest.mark.parametrize("known", [True, False])
def test_a_cutoff_gives_the_fewest_modes_that_reach_it(known: bool) -> None:
    cutoffs = [1.2, 1.1, 1.5, 3.0] if known else [1.2, 1.1, 1.5]  # it falls once
    curve = Curve.start(1.0, 3.0, 40).with_knots([10, 20, 30, 40][: len(cutoffs)], cutoffs)
    assert curve.count_at(0.5) == curve.count_at(1.0) == 0
    assert curve.count_at(1.2) == 10
    assert curve.count_at(3.0) == curve.count_at(9.0) == 40, "beyond the original there is none"
    for k in (5, 27, 35):
        assert curve.count_at(curve.cutoff(k)) == k
    for wanted in np.linspace(1.01, 2.99, 50):
        k = curve.count_at(float(wanted))
        assert curve.cutoff(k) >= wanted - 1e-6 > curve.cutoff(k - 1) - 2e-6


def test_what_a_level_means_does_not_change_as_modes_arrive() -> None:
    mesh = _wavy(4000)
    settled: dict[float, tuple[int, bytes]] = {}
    jumps = []
    for parts in decompose_stream(mesh, _disc(mesh, 0.45)):
        counts = [parts.mode_count(level) for level in np.linspace(0, 1, 101)]
        assert counts[0] == 0
        assert counts[-1] == parts.m
        assert (np.diff(counts) >= 0).all()
        for level in np.linspace(0.02, 0.98, 13):
            now = (parts.mode_count(level), parts.surface(parts.mode_count(level)).tobytes())
            if level in settled:
                assert settled[level] == now
            elif parts.reaches(level):
                settled[level] = now
        jumps.append(parts)
    last = jumps[-1]
    assert last.complete
    assert len(settled) == 13
    assert last.k < last.m
    for level in (0.1, 0.5, 0.97):
        until = decompose_until(mesh, last.roi, level)
        assert until.mode_count(level) == last.mode_count(level)
        k = last.mode_count(level)
        assert (until.surface(k) == last.surface(k)).all()
        assert (until.high(k) == last.high(k)).all()


def test_slider_covers_everything_without_a_jump() -> None:
    mesh = _wavy(4000)
    parts = decompose(mesh, _disc(mesh, 0.45))
    assert parts.k < parts.m
    # Up to here every count of modes is there; one mode may well hold half of a regular wave.
    beyond = np.linspace(parts.level_of(parts.k), 1, 201)
    surfaces = [parts.surface(parts.mode_count(level)) for level in beyond]
    steps = [np.abs(b - a).max() for a, b in pairwise(surfaces)]
    whole = np.abs(parts.original - parts.base).max()
    assert max(steps) < 0.01 * whole
    k = parts.k
    assert np.abs(parts.surface(k + 1) - parts.surface(k)).max() < 1e-3 * whole


@pytest.mark.parametrize("share", [0.1, 0.3, 0.7])
def test_filter_is_the_step_of_the_eigenvalues(wavy: Decomposition, share: float) -> None:
    root = np.sqrt(wavy.areas)
    d = sp.diags_array(1 / root)
    s = sp.csr_array(d @ wavy.region.stiffness_roi @ d)
    r = root[:, None] * wavy.delta_residual
    k = int(share * wavy.m)
    cutoff = float(wavy.eigenvalues[k])
    y = root[:, None] * wavy.modes
    exact = y @ (step(wavy.eigenvalues, cutoff)[:, None] * (y.T @ r))
    found = lowpass(s, r, cutoff, Run())
    assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max()


def test_filter_and_modes_agree_where_both_work(
    wavy: Decomposition, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decomposition_module, "default_modes", lambda m: 100)
    filtered = decompose(wavy.region.mesh, wavy.roi)
    assert filtered.k == 100
    assert len(filtered.rest) >= 3
    missing = np.linalg.norm(wavy.original - wavy.base)
    for anchor in filtered.rest:
        modes = wavy.surface(anchor.count)
        assert np.linalg.norm(anchor.surface - modes) < 0.05 * missing
        assert wavy.level_of(anchor.count) == pytest.approx(
            filtered.level_of(anchor.count), abs=0.05
        )
        wave = wavy.eigenvalues[anchor.count - 1 : anchor.count + 1]
        assert wave[0] <= anchor.wave <= wave[-1]
    for level in np.linspace(0, 1, 21):
        a, b = (p.surface(p.mode_count(level)) for p in (wavy, filtered))
        assert np.linalg.norm(a - b) < 0.1 * missing
    k = filtered.rest[1].count
    back = filtered.reconstruct(filtered.surface(k), filtered.high(k))
    assert np.abs(back - filtered.original).max() < 1e-11


def test_wavelength_of_a_square() -> None:
    mesh = flat(4000)
    parts = decompose(mesh, interior(mesh), modes=60)
    assert parts.wavelength(1) == pytest.approx(np.sqrt(2), rel=0.01)
    assert parts.wavelength(0) == float("inf")
    lengths = [parts.wavelength(k) for k in range(1, parts.m, 37)]
    assert (np.diff(lengths) <= 0).all()
    for k in (1, 7, 60, 1000):
        assert parts.mode_count_at(parts.wavelength(k)) in (k - 1, k, k + 1)
    assert parts.mode_count_at(0.0) == parts.m
    assert parts.mode_count_at(10.0) == 0


@pytest.mark.parametrize("k", [0, 5, 31, 32, 77, 100])
def test_no_slider_step_sums_more_than_a_chunk_of_modes(wavy: Decomposition, k: int) -> None:
    spoiled = wavy.modes.copy(order="F")
    spoiled[:, : k - k % CHUNK] = np.nan
    spoiled[:, k:] = np.nan
    few = replace(wavy, modes=spoiled)
    assert (few.surface(k) == wavy.surface(k)).all()
    assert (few.delta(k) == wavy.delta(k)).all()


# What must not change the answer.


def _bumpy_ball() -> tuple[Mesh, np.ndarray]:
    mesh = icosphere_like(900)
    bumps = 1 + 0.03 * np.sin(9 * mesh.vertices).prod(axis=1)
    return mesh.with_vertices(mesh.vertices * bumps[:, None]), ball(mesh, 200)


BALL, ROI = _bumpy_ball()
PARTS = decompose(BALL, ROI)


def _compare(parts: Decomposition, moved: np.ndarray, scale: float, tolerance: float) -> None:
    """Check that the parts are PARTS with positions taken by `moved`-like motion and scale."""
    assert parts.eigenvalues * scale**2 == pytest.approx(PARTS.eigenvalues, rel=tolerance)
    for k in (0, 10, 60):
        assert parts.level_of(k) == pytest.approx(PARTS.level_of(k), abs=max(tolerance, 1e-9))
    assert np.abs(parts.base - moved).max() < tolerance * scale


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), exponent=st.floats(-6, 6))
def test_rigid_motion_and_uniform_scale(seed: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    if np.linalg.det(turn) < 0:
        turn[0] *= -1
    scale = 10.0**exponent
    shift = scale * rng.standard_normal(3)
    parts = decompose(BALL.with_vertices(scale * BALL.vertices @ turn.T + shift), ROI)
    _compare(parts, scale * PARTS.base @ turn.T + shift, scale, 1e-8)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000), exponent=st.sampled_from([-3, 0, 3]))
def test_far_offset(seed: int, exponent: int) -> None:
    scale = 10.0**exponent
    shift = 2e6 * scale * np.random.default_rng(seed).choice([-1.0, 1.0], 3)
    parts = decompose(BALL.with_vertices(scale * BALL.vertices + shift), ROI)
    # Rounding of the coordinates themselves: 2e6 * 2^-53 beside edges of a tenth.
    _compare(parts, scale * PARTS.base + shift, scale, 1e-6)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_renumbering_of_vertices_and_faces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    order = rng.permutation(BALL.n)
    place = np.argsort(order)
    faces = rng.permutation(place[BALL.faces])
    faces = np.take_along_axis(faces, (np.arange(3) + rng.integers(0, 3, (len(faces), 1))) % 3, 1)
    parts = decompose(Mesh(BALL.vertices[order], faces), place[ROI])
    back = np.searchsorted(parts.roi, place[PARTS.roi])
    assert parts.eigenvalues == pytest.approx(PARTS.eigenvalues, rel=1e-9)
    assert np.abs(parts.base[back] - PARTS.base).max() < 1e-10
    for k in (1, 20, 100):
        assert np.abs(parts.surface(k)[back] - PARTS.surface(k)).max() < 1e-8


def test_mirror_symmetric_input_gives_symmetric_output() -> None:
    mesh = _wavy(900)
    twin = mesh.with_vertices(mesh.vertices * [-1.0, 1.0, 1.0])
    roi = _disc(mesh)
    a = decompose(mesh, roi)
    b = decompose(Mesh(twin.vertices, twin.faces[:, ::-1]), roi)
    assert np.abs(a.base * [-1, 1, 1] - b.base).max() < 1e-11
    assert np.abs(a.surface(40) * [-1, 1, 1] - b.surface(40)).max() < 1e-9
    assert [a.mode_count(x) for x in (0.3, 0.6)] == [b.mode_count(x) for x in (0.3, 0.6)]


def test_two_parts_of_a_region_do_not_know_of_each_other() -> None:
    a, b = icosphere_like(500), icosphere_like(300, 2.0, seed=5)
    both = Mesh(
        np.concatenate([a.vertices, b.vertices + np.array([5, 0, 0])]),
        np.concatenate([a.faces, b.faces + 500]),
    )
    roi_a, roi_b = ball(a, 80), ball(b, 120)
    together = decompose(both, np.concatenate([roi_a, 500 + roi_b]))
    apart = [decompose(a, roi_a), decompose(b, roi_b)]
    assert np.abs(together.base[:80] - apart[0].base).max() < 1e-10
    values = np.sort(np.concatenate([p.eigenvalues for p in apart]))
    assert together.eigenvalues == pytest.approx(values, rel=1e-9)


def test_arrays_cannot_be_written_to(wavy: Decomposition) -> None:
    for array in (wavy.modes, wavy.eigenvalues, wavy.eta):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
