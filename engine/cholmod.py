"""CHOLMOD, called through ctypes so that the interpreter's lock is free while it works.

The shared library is the one that the cvxopt (or kvxopt) wheels carry; their own binding holds
the lock for the whole factorisation, which would stall a window for as long.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import importlib.util
import threading
import weakref
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64
from engine.errors import SolveError

# Room for cholmod_common of any 3.x or 4.x release (2.7 kB), and where its fields lie as ints.
_COMMON_BYTES = 65536
_SUPERNODAL, _PRINT = 12, 36
_SIMPLICIAL, _AUTO = 0, 1
_REAL, _INT, _UPPER, _SOLVE_A = 1, 0, 1, 0


class _Sparse(ctypes.Structure):
    _fields_ = [
        ("nrow", ctypes.c_size_t),
        ("ncol", ctypes.c_size_t),
        ("nzmax", ctypes.c_size_t),
        ("p", ctypes.c_void_p),
        ("i", ctypes.c_void_p),
        ("nz", ctypes.c_void_p),
        ("x", ctypes.c_void_p),
        ("z", ctypes.c_void_p),
        ("stype", ctypes.c_int),
        ("itype", ctypes.c_int),
        ("xtype", ctypes.c_int),
        ("dtype", ctypes.c_int),
        ("sorted", ctypes.c_int),
        ("packed", ctypes.c_int),
    ]


class _Dense(ctypes.Structure):
    _fields_ = [
        ("nrow", ctypes.c_size_t),
        ("ncol", ctypes.c_size_t),
        ("nzmax", ctypes.c_size_t),
        ("d", ctypes.c_size_t),
        ("x", ctypes.c_void_p),
        ("z", ctypes.c_void_p),
        ("xtype", ctypes.c_int),
        ("dtype", ctypes.c_int),
    ]


class _Factor(ctypes.Structure):
    _fields_ = [
        ("n", ctypes.c_size_t),
        ("minor", ctypes.c_size_t),
        ("perm", ctypes.c_void_p),
        ("colcount", ctypes.c_void_p),
        ("iperm", ctypes.c_void_p),
        ("nzmax", ctypes.c_size_t),
        ("p", ctypes.c_void_p),
        ("i", ctypes.c_void_p),
        ("x", ctypes.c_void_p),
    ]


class CholmodFactor:
    """P A P^T = L L^T (definite) or L D L^T (indefinite, no pivoting) by CHOLMOD.

    Parameters
    ----------
    a : (n, n) symmetric, both triangles stored, indices sorted.
    definite : whether `a` is positive definite; only then it may use supernodes.

    Raises
    ------
    SolveError
        A pivot is zero, or negative although the matrix should be definite.
    """

    def __init__(self, a: sp.csr_array, definite: bool = True) -> None:
        lib = library()
        assert lib is not None
        self._lib = lib
        self._lock = threading.Lock()
        self.n = int(a.shape[0])
        # By symmetry the rows of the lower triangle are the columns of the upper one.
        row = np.repeat(np.arange(self.n), np.diff(a.indptr))
        lower = a.indices <= row
        p = np.zeros(self.n + 1, dtype=np.int32)
        np.cumsum(np.bincount(row[lower], minlength=self.n), out=p[1:])
        i = a.indices[lower].astype(np.int32)
        x = np.ascontiguousarray(a.data[lower], dtype=np.float64)
        common = ctypes.create_string_buffer(_COMMON_BYTES)
        lib.cholmod_start(common)
        ints = ctypes.cast(common, ctypes.POINTER(ctypes.c_int))
        ints[_SUPERNODAL] = _AUTO if definite else _SIMPLICIAL
        ints[_PRINT] = 0
        sparse = _Sparse(
            self.n, self.n, len(x), p.ctypes.data, i.ctypes.data, None, x.ctypes.data, None,
            _UPPER, _INT, _REAL, 0, 1, 1,
        )  # fmt: skip
        self._common = common
        self._factor = lib.cholmod_analyze(ctypes.byref(sparse), common)
        if self._factor:
            lib.cholmod_factorize(ctypes.byref(sparse), ctypes.c_void_p(self._factor), common)
            weakref.finalize(self, _release, lib, self._factor, common)
        found = self._struct()
        if found is None or found.minor < self.n or (definite and self.negative > 0):
            raise SolveError(
                "The equations of the region have no unique solution. "
                "Clean the mesh, or choose another region."
            )

    def _struct(self) -> _Factor | None:
        if not self._factor:
            return None
        return ctypes.cast(self._factor, ctypes.POINTER(_Factor)).contents

    @property
    def negative(self) -> int:
        """Number of negative pivots D, which is that of the negative eigenvalues (Sylvester)."""
        f = self._struct()
        assert f is not None
        tail = ctypes.cast(self._factor + ctypes.sizeof(_Factor), ctypes.POINTER(ctypes.c_size_t))
        # After x: z, nz, next, prev, nsuper, ssize, xsize, maxcsize, maxesize, super, pi, px, s,
        # then the ints ordering, is_ll, is_super.
        flags = ctypes.cast(
            ctypes.addressof(tail.contents) + 13 * ctypes.sizeof(ctypes.c_size_t),
            ctypes.POINTER(ctypes.c_int),
        )
        if flags[1] or flags[2]:
            return 0
        at = np.ctypeslib.as_array(ctypes.cast(f.p, ctypes.POINTER(ctypes.c_int32)), (self.n,))
        x = np.ctypeslib.as_array(ctypes.cast(f.x, ctypes.POINTER(ctypes.c_double)), (f.nzmax,))
        return int(np.count_nonzero(x[at] < 0))

    def solve(self, b: F64) -> F64:
        """Return x with A x = b for b (n,) or (n, r).

        Raises
        ------
        SolveError
            There is not enough memory.
        """
        rhs = np.asfortranarray(b, dtype=np.float64)
        r = 1 if rhs.ndim == 1 else rhs.shape[1]
        if r == 0:
            return np.zeros_like(rhs)
        dense = _Dense(self.n, r, self.n * r, self.n, rhs.ctypes.data, None, _REAL, 0)
        with self._lock:
            found = self._lib.cholmod_solve(
                _SOLVE_A, ctypes.c_void_p(self._factor), ctypes.byref(dense), self._common
            )
            if not found:
                raise SolveError(
                    "There is not enough memory to solve for this region. Choose a smaller one."
                )
            data = ctypes.cast(found, ctypes.POINTER(_Dense)).contents.x
            flat = np.ctypeslib.as_array(
                ctypes.cast(data, ctypes.POINTER(ctypes.c_double)), (r * self.n,)
            )
            x = flat.copy()
            handle = ctypes.c_void_p(found)
            self._lib.cholmod_free_dense(ctypes.byref(handle), self._common)
        return x if b.ndim == 1 else x.reshape((r, self.n)).T


def _release(lib: ctypes.CDLL, factor: int, common: ctypes.Array[ctypes.c_char]) -> None:
    handle = ctypes.c_void_p(factor)
    lib.cholmod_free_factor(ctypes.byref(handle), common)
    lib.cholmod_finish(common)


@cache
def library() -> ctypes.CDLL | None:
    """Return the CHOLMOD library if one is at hand, of a known layout and right on a small case."""
    for path in _candidates():
        try:
            lib = ctypes.CDLL(str(path))
            lib.cholmod_start.restype = ctypes.c_int
            lib.cholmod_analyze.restype = ctypes.c_void_p
            lib.cholmod_solve.restype = ctypes.c_void_p
            version = (ctypes.c_int * 3)()
            lib.cholmod_version(version)
        except (OSError, AttributeError):
            continue
        if version[0] in (3, 4):
            return lib
    return None


@cache
def usable() -> bool:
    """Return whether CHOLMOD is there and solves two small systems with the right inertia."""
    if library() is None:
        return False
    second = np.diag(np.full(40, 2.0)) - np.eye(40, k=1) - np.eye(40, k=-1)
    ones = np.ones(40)
    for a, definite, negative in ((second, True, 0), (second - 0.97 * np.eye(40), False, 13)):
        try:
            factor = CholmodFactor(sp.csr_array(a), definite)
        except SolveError:
            return False
        if factor.negative != negative or not np.allclose(a @ factor.solve(ones), ones):
            return False
    return True


def _candidates() -> list[Path]:
    found: list[Path] = []
    for package in ("cvxopt", "kvxopt"):
        spec = importlib.util.find_spec(package)
        if spec is None or spec.origin is None:
            continue
        home = Path(spec.origin).parent
        libs = [*home.parent.glob(f"{package}.libs/*cholmod*"), *home.glob(".dylibs/*cholmod*")]
        if libs:
            # Loading the binding first makes the libraries that CHOLMOD itself needs known.
            importlib.import_module(f"{package}.cholmod")
            found += libs
    return found
