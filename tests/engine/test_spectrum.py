"""Modes: closed forms, independent libraries, none missing, cancelled at once, the same bits."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import lapy
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.special import jn_zeros

from engine import Cancelled, Mesh, Region, Run, decompose, decompose_stream
from engine import decomposition as decomposition_module
from engine import slicing as slicing_module
from engine import spectrum as spectrum_module
from engine.arrays import F64
from engine.errors import RegionError, SolveError
from engine.slicing import sliced
from engine.spectrum import bands
from tests.engine.surfaces import ball, flat, icosphere_like, interior, real


def _gram_error(parts: object) -> float:
    gram = parts.modes.T @ (parts.areas[:, None] * parts.modes)
    return float(np.abs(gram - np.eye(parts.k)).max())


def test_square_plate() -> None:
    mesh = flat(10_000)
    mesh = mesh.with_vertices(3.0 * mesh.vertices)
    parts = decompose(mesh, interior(mesh), modes=50)
    i, j = np.meshgrid(np.arange(1, 20), np.arange(1, 20))
    exact = np.sort((np.pi / 3) ** 2 * (i**2 + j**2).ravel())[:50]
    assert parts.eigenvalues == pytest.approx(exact, rel=0.02)
    assert _gram_error(parts) < 1e-8


def test_disc_has_the_zeros_of_bessel_functions() -> None:
    mesh = flat(6000, "disc")
    parts = decompose(mesh, interior(mesh), modes=30)
    zeros = [jn_zeros(n, 10) for n in range(12)]
    exact = np.sort(np.concatenate([zeros[0], *(np.repeat(z, 2) for z in zeros[1:])]) ** 2)[:30]
    assert parts.eigenvalues == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize("m", [1, 2, 3, 5, 9, 10])
def test_tiny_regions_have_as_many_modes_as_vertices(m: int) -> None:
    mesh = icosphere_like(400)
    parts = decompose(mesh, ball(mesh, m), modes=50)
    assert parts.k == m
    assert (parts.eigenvalues > 0).all()
    assert _gram_error(parts) < 1e-12


@pytest.mark.parametrize("name", ["spot.obj", "hammer.obj", "mountain_open.obj"])
def test_bands_agree_with_scipy_on_real_meshes(shared_meshes: Path, name: str) -> None:
    mesh = real(shared_meshes, name)
    region = Region(mesh, ball(mesh, 3000))
    parts = decompose(mesh, region.roi, modes=200)
    K, M = region.stiffness_roi, sp.diags_array(region.areas_roi)
    theirs = spla.eigsh(sp.csc_array(K), 200, sp.csc_array(M), sigma=0, return_eigenvectors=False)
    ours = parts.eigenvalues * region.scale**2
    assert np.abs(ours / np.sort(theirs) - 1).max() < 1e-8
    assert _gram_error(parts) < 1e-8
    left = K @ parts.modes - (M @ parts.modes) * ours
    assert np.abs(left).max() < 1e-6 * np.abs(K @ parts.modes).max()


def test_agrees_with_lapy_on_a_real_mesh(shared_meshes: Path) -> None:
    mesh = real(shared_meshes, "spot.obj")
    region = Region(mesh, ball(mesh, 2000))
    solver = lapy.Solver(lapy.TriaMesh(mesh.vertices, mesh.faces), lump=True)
    inner = region.roi
    K = sp.csr_array(solver.stiffness)[inner][:, inner]
    M = sp.csr_array(solver.mass)[inner][:, inner]
    theirs = spla.eigsh(sp.csc_array(K), 60, sp.csc_array(M), sigma=0, return_eigenvectors=False)
    # LaPy lumps a third of each triangle to its corners, we take Voronoi areas: close, not equal.
    ours = decompose(mesh, inner, modes=60).eigenvalues
    assert np.abs(ours / np.sort(theirs) - 1).max() < 0.03
    mass = M.diagonal()
    swapped = bands(sp.csr_array(K), mass, 60)
    values = np.concatenate([v for v, _ in swapped])[:60]
    assert np.abs(values / np.sort(theirs) - 1).max() < 1e-8


def test_modes_of_different_bands_are_orthonormal() -> None:
    mesh = flat(6400)
    parts = decompose(mesh, interior(mesh), modes=900)
    assert _gram_error(parts) < 1e-9


def test_no_mode_is_missing_in_the_bands() -> None:
    mesh = flat(2025)
    roi = interior(mesh)
    dense = decompose(mesh, roi, modes=mesh.n)
    assert dense.k == dense.m
    banded = decompose(mesh, roi, modes=450)
    assert np.abs(banded.eigenvalues / dense.eigenvalues[:450] - 1).max() < 1e-9
    # The same spaces: every banded mode lies in the span of the dense ones of its eigenvalue.
    overlap = dense.modes[:, :460].T @ (dense.areas[:, None] * banded.modes)
    assert np.abs((overlap**2).sum(axis=0) - 1).max() < 1e-8


def _symmetric_plate(side: int) -> Mesh:
    g = np.linspace(0, 1, side)
    u, v = (a.ravel() for a in np.meshgrid(g, g, indexing="ij"))
    ids = np.arange(side * side).reshape(side, side)
    a, b, c, d = ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]
    odd = (np.add.outer(np.arange(side - 1), np.arange(side - 1)) % 2)[..., None, None]
    one = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2)
    two = np.stack([np.stack([a, b, d], -1), np.stack([b, c, d], -1)], axis=2)
    return Mesh(np.column_stack([u, v, 0 * u]), np.where(odd, one, two).reshape(-1, 3))


def _sliced_and_exact(mesh: Mesh, more_than: int) -> tuple[F64, F64, F64]:
    """The first eigenvalues of M^-1/2 K M^-1/2 by slices and by LAPACK, and the slices' vectors.

    Inside the mesh's border, and some more than `more_than` of them; the vectors are rows.
    """
    region = Region(mesh, interior(mesh))
    d = sp.diags_array(1 / np.sqrt(region.areas_roi))
    s = sp.csr_array(d @ region.stiffness_roi @ d)
    exact = np.linalg.eigvalsh(s.toarray())
    found, rows = np.empty(0), []
    for values, vectors in sliced(s, float(region.areas_roi.sum()), Run()):
        found = np.append(found, values)
        rows.append(vectors)
        if len(found) > more_than:
            break
    return found, exact[: len(found)], np.concatenate(rows)


def test_double_eigenvalues_of_a_symmetric_plate_are_both_found() -> None:
    mesh = _symmetric_plate(47)
    found, exact, _ = _sliced_and_exact(mesh, 400)
    assert np.abs(found / exact - 1).max() < 1e-9


def test_many_equal_islands_show_all_copies_of_each_mode() -> None:
    side, copies = 12, 8
    mesh = _symmetric_plate(side)
    x = np.concatenate([mesh.vertices + np.array([2.0 * i, 0, 0]) for i in range(copies)])
    f = np.concatenate([mesh.faces + i * mesh.n for i in range(copies)])
    many = Mesh(x, f)
    found, exact, y = _sliced_and_exact(many, 150)
    assert np.abs(found / exact - 1).max() < 1e-8
    assert np.abs(y @ y.T - np.eye(len(y))).max() < 1e-8


def test_stream_is_a_prefix_of_what_follows_and_repeats_to_the_bit() -> None:
    mesh = icosphere_like(9000)
    roi = ball(mesh, 3000)
    items = list(decompose_stream(mesh, roi, modes=250))
    assert [p.k for p in items] == sorted(p.k for p in items)
    assert items[0].k == 0
    assert len(items) > 4
    last = items[-1]
    for item in items:
        assert (last.modes[:, : item.k] == item.modes).all()
        assert (last.eigenvalues[: item.k] == item.eigenvalues).all()
        assert (last.surface(item.k) == item.surface(item.k)).all()
    again = decompose(mesh, roi, modes=250)
    assert (again.modes == last.modes).all()
    fewer = decompose(mesh, roi, modes=120)
    assert (last.modes[:, :120] == fewer.modes).all()
    assert (last.surface(120) == fewer.surface(120)).all()


def test_bits_do_not_depend_on_a_busy_second_thread() -> None:
    mesh = icosphere_like(6000)
    roi = ball(mesh, 2500)
    alone = decompose(mesh, roi, modes=100)
    stop = threading.Event()

    def burn() -> None:
        a = np.random.default_rng(0).standard_normal((200, 200))
        while not stop.is_set():
            a @ a

    thread = threading.Thread(target=burn)
    thread.start()
    beside = decompose(mesh, roi, modes=100)
    stop.set()
    thread.join(30)
    assert (alone.modes == beside.modes).all()


def test_largest_entry_of_every_mode_is_positive() -> None:
    mesh = icosphere_like(2000)
    modes = decompose(mesh, ball(mesh, 400)).modes
    assert (modes[np.abs(modes).argmax(axis=0), np.arange(modes.shape[1])] > 0).all()


@pytest.mark.parametrize(
    "slow",
    [
        pytest.param((decomposition_module, "with_base"), id="base"),
        pytest.param((np.linalg, "eigh"), id="dense modes"),
        pytest.param((slicing_module, "shift_at"), id="bands"),
    ],
)
def test_cancel_is_answered_while_the_work_under_way_goes_on(
    slow: tuple[object, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ends, run = threading.Event(), threading.Event(), Run()
    answered: list[bool] = []

    def takes_for_ever(*_args: object) -> None:
        begun.set()
        ends.wait(60)
        raise Cancelled

    def work() -> None:
        try:
            decompose(mesh, ball(mesh, size), modes=100, run=run)
        except Cancelled:
            answered.append(not ends.is_set())

    size = 2000 if slow[1] == "shift_at" else 400
    mesh = icosphere_like(2 * size)
    monkeypatch.setattr(*slow, takes_for_ever)
    thread = threading.Thread(target=work)
    thread.start()
    try:
        assert begun.wait(30)
        run.cancel()
        thread.join(30)
        assert answered == [True]
    finally:
        ends.set()
        thread.join(30)


def test_too_many_modes_of_a_large_region_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spectrum_module, "DENSE_LARGEST", 2000)
    mesh = icosphere_like(4000)
    with pytest.raises(Exception, match=r"out of reach\. Ask for at most"):
        decompose(mesh, ball(mesh, 2500), modes=2500)


@pytest.mark.parametrize("bands_done", [0, 1])
def test_where_modes_fail_there_are_fewer_and_the_slider_is_whole(
    bands_done: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = flat(2500)
    mesh = mesh.with_vertices(
        mesh.vertices + np.outer(0.01 * np.sin(40 * mesh.vertices[:, 0]), [0.0, 0.0, 1.0])
    )

    def failing(*given: object) -> Iterator[tuple[F64, F64]]:
        for i, band in enumerate(bands(*given)):
            if i == bands_done:
                raise SolveError("A band is missing. Clean the mesh.")
            yield band

    whole = decompose(mesh, interior(mesh))
    monkeypatch.setattr("engine.decomposition.bands", failing)
    parts = decompose(mesh, interior(mesh))
    assert (parts.k > 0) == (bands_done > 0)
    assert f"Only {parts.k} of {whole.k} modes" in parts.report
    assert np.array_equal(parts.eigenvalues, whole.eigenvalues[: parts.k])
    assert parts.complete
    assert parts.surface(parts.m) is parts.original
    levels = np.linspace(0, 1, 30)
    counts = [parts.mode_count(level) for level in levels]
    assert counts == sorted(counts)
    errors = [np.linalg.norm(parts.surface(k) - parts.original) for k in counts]
    assert errors[-1] == 0.0
    assert errors[15] < 0.7 * errors[0]


def test_size_whose_area_underflows_is_refused() -> None:
    mesh = flat(100)
    tiny = Mesh(1e-200 * mesh.vertices, mesh.faces)
    with pytest.raises(RegionError, match="Scale the model"):
        decompose(tiny, interior(tiny))
