"""Every solver passes the same tests."""

from __future__ import annotations

import threading
import time
from typing import get_args

import numpy as np
import pytest
import scipy.sparse as sp

from engine import SolveError, cholmod, cotangent_stiffness
from engine.solve import Backend, best_backend, factorise
from tests.engine.surfaces import flat, interior

BACKENDS = [
    pytest.param(
        b, marks=pytest.mark.skipif(b == "cholmod" and not cholmod.usable(), reason="no CHOLMOD")
    )
    for b in get_args(Backend)
]


def _dirichlet(n: int) -> sp.csr_array:
    mesh = flat(n)
    inner = interior(mesh)
    return sp.csr_array(cotangent_stiffness(mesh)[inner][:, inner])


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("columns", [None, 1, 3, 20])
def test_solves_to_rounding(backend: Backend, columns: int | None) -> None:
    a = _dirichlet(2500)
    shape = (a.shape[0],) if columns is None else (a.shape[0], columns)
    x = np.random.default_rng(0).standard_normal(shape)
    found = factorise(a, backend=backend).solve(a @ x)
    assert found.shape == shape
    assert np.abs(found - x).max() < 1e-10


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("n", [1, 2, 9])
def test_tiny_systems(backend: Backend, n: int) -> None:
    a = sp.csr_array(np.eye(n) * 3 + np.ones((n, n)))
    assert factorise(a, backend=backend).solve(np.ones(n)) == pytest.approx(1 / (3 + n))


@pytest.mark.parametrize("backend", BACKENDS)
def test_entries_of_very_different_size(backend: Backend) -> None:
    a = _dirichlet(900)
    d = sp.diags_array(10.0 ** np.random.default_rng(1).uniform(-9, 9, a.shape[0]))
    scaled = sp.csr_array(d @ a @ d)
    x = np.random.default_rng(0).standard_normal(a.shape[0]) / d.diagonal()
    found = factorise(scaled, backend=backend).solve(scaled @ x)
    assert np.abs((found - x) * d.diagonal()).max() < 1e-6


@pytest.mark.parametrize("backend", BACKENDS)
def test_inertia_counts_the_eigenvalues_below_a_shift(backend: Backend) -> None:
    a = _dirichlet(900)
    values = np.linalg.eigvalsh(a.toarray())
    for count in (0, 1, 17, 100, len(values) - 3):
        shift = (values[count - 1] + values[count]) / 2 if count else values[0] / 2
        shifted = sp.csr_array(a - shift * sp.eye_array(len(values), format="csr"))
        factor = factorise(shifted, definite=False, backend=backend)
        assert factor.negative == count
        b = np.ones(len(values))
        assert np.linalg.norm(shifted @ factor.solve(b) - b) < 1e-8 * np.linalg.norm(b)


@pytest.mark.parametrize("backend", BACKENDS)
def test_singular_matrix_is_refused(backend: Backend) -> None:
    loose = cotangent_stiffness(flat(400))
    with pytest.raises(SolveError, match="Clean the mesh"):
        factorise(sp.csr_array(loose), backend=backend).solve(
            np.arange(loose.shape[0], dtype=float)
        )


@pytest.mark.parametrize("backend", BACKENDS)
def test_matrix_that_should_be_definite_and_is_not_is_refused(backend: Backend) -> None:
    a = sp.csr_array(sp.diags_array(np.r_[np.ones(20), -1.0]))
    with pytest.raises(SolveError):
        factorise(a, backend=backend)


def test_numbers_that_are_not_finite_are_refused() -> None:
    with pytest.raises(SolveError, match="not finite"):
        factorise(sp.csr_array(np.array([[np.nan]])))


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_same_bits_every_time(backend: Backend) -> None:
    a = _dirichlet(2500)
    b = np.random.default_rng(0).standard_normal((a.shape[0], 3))
    first = factorise(a, backend=backend).solve(b)
    assert (factorise(a, backend=backend).solve(b) == first).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_one_factor_serves_several_threads(backend: Backend) -> None:
    a = _dirichlet(2500)
    factor = factorise(a, backend=backend)
    b = np.random.default_rng(0).standard_normal((a.shape[0], 4))
    right = factor.solve(b)
    wrong = []

    def work() -> None:
        for _ in range(20):
            if not (factor.solve(b) == right).all():
                wrong.append(1)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert not wrong


@pytest.mark.skipif(best_backend() != "cholmod", reason="SuperLU holds the lock in large systems")
def test_another_thread_goes_on_while_the_best_solver_works() -> None:
    a = _dirichlet(40_000)
    q = sp.csr_array(a @ sp.diags_array(1 / a.diagonal()) @ a)
    worked, done = [0.0], threading.Event()

    def beside() -> None:
        while not done.is_set():
            worked[0] = time.thread_time()

    thread = threading.Thread(target=beside)
    thread.start()
    begun = time.thread_time()
    factorise(q)
    took = time.thread_time() - begun
    done.set()
    thread.join(30)
    # With the lock held throughout it would get next to none of the processor.
    assert worked[0] > 0.2 * took
