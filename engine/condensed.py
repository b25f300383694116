"""A factor that eliminates some unknowns last, so that forces on these are answered quickly.

With the unknowns b last, P A P^T = L L^T with

    L = [ L_ii    0   ]
        [ L_bi   L_bb ]

and for forces f on b alone, A^-1 E f is one backward solve, L^T y = (0, L_bb^-1 f): no forward
solve and no response matrix. The compliance of b comes with the factor, S = (L_bb L_bb^T)^-1.
Putting a curve of anchors last costs a few per cent of fill; solving for each of them would cost
four times the factor.
"""

from __future__ import annotations

import ctypes
import weakref
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from engine import cholmod
from engine.arrays import F64, I64
from engine.errors import SolveError

# Fields of cholmod_common as ints, and its constants; `engine.cholmod` checks the version.
_SUPERNODAL, _PRINT, _METHODS = 12, 36, 42
_DEFAULTS = (1, 3, 0)
_ALWAYS, _ONE_METHOD, _SOLVE_LT = 2, 1, 5
_UPPER, _INT, _REAL = 1, 0, 1
# Fields of cholmod_factor behind x, as words.
_N_SUPER, _SUPER, _PI, _PX, _S = 4, 9, 10, 11, 12


class Condensed:
    """A positive definite matrix factorised by CHOLMOD with some unknowns last.

    Parameters
    ----------
    a : (n, n) positive definite, both triangles stored, indices sorted.
    last : (c,) unknowns that forces act on, each once.

    Raises
    ------
    SolveError
        The matrix is not positive definite, or the unknowns cannot be put last.
    """

    def __init__(self, a: sp.csr_array, last: I64) -> None:
        lib = cholmod.library()
        if lib is None:
            raise SolveError("CHOLMOD is not there. Install cvxopt.")
        self._lib = lib
        self.n = int(a.shape[0])
        self._last = last
        self._scale: F64 = 1 / np.sqrt(a.diagonal())
        self._factorise(a, last)
        tail = self._order[self.n - len(last) :]
        if not np.array_equal(np.sort(tail), np.sort(last)):
            raise SolveError("The anchors lie in separate parts. Solve for each of them instead.")
        place = np.empty(self.n, dtype=np.int64)
        place[self._order] = np.arange(self.n)
        self._tail = place[last] - (self.n - len(last))
        self._corner = self._trailing(len(last))

    def _factorise(self, a: sp.csr_array, last: I64) -> None:
        lib = self._lib
        lib.cholmod_analyze_p.restype = ctypes.c_void_p
        row = np.repeat(np.arange(self.n), np.diff(a.indptr))
        lower = a.indices <= row
        p = np.zeros(self.n + 1, dtype=np.int32)
        np.cumsum(np.bincount(row[lower], minlength=self.n), out=p[1:])
        i = a.indices[lower].astype(np.int32)
        x = a.data[lower] * self._scale[row[lower]] * self._scale[i]
        sparse = cholmod._Sparse(
            self.n, self.n, len(x), p.ctypes.data, i.ctypes.data, None, x.ctypes.data, None,
            _UPPER, _INT, _REAL, 0, 1, 1,
        )  # fmt: skip
        common = self._common()
        free = ctypes.c_void_p(lib.cholmod_analyze(ctypes.byref(sparse), common))
        order = self._permutation(free.value)
        lib.cholmod_free_factor(ctypes.byref(free), common)
        is_last = np.zeros(self.n, dtype=bool)
        is_last[last] = True
        wanted = np.concatenate([order[~is_last[order]], last]).astype(np.int32)
        ctypes.cast(common, ctypes.POINTER(ctypes.c_int))[_METHODS] = _ONE_METHOD
        self._factor = lib.cholmod_analyze_p(
            ctypes.byref(sparse),
            ctypes.c_void_p(wanted.ctypes.data),
            None,
            ctypes.c_size_t(0),
            common,
        )
        if self._factor:
            weakref.finalize(self, _release, lib, self._factor)
            lib.cholmod_factorize(ctypes.byref(sparse), ctypes.c_void_p(self._factor), common)
        lib.cholmod_finish(common)
        if not self._factor or self._struct(self._factor).minor < self.n:
            raise SolveError(
                "The surface at this level cannot be prepared for the anchors. "
                "Clean the mesh, or choose another region."
            )
        self._order = self._permutation(self._factor)

    def _common(self) -> Any:
        common = ctypes.create_string_buffer(cholmod._COMMON_BYTES)
        self._lib.cholmod_start(common)
        ints = ctypes.cast(common, ctypes.POINTER(ctypes.c_int))
        if (ints[_SUPERNODAL], ints[_PRINT], ints[_METHODS]) != _DEFAULTS:
            raise SolveError("This release of CHOLMOD lays its settings out in an unknown way.")
        ints[_SUPERNODAL], ints[_PRINT] = _ALWAYS, 0
        return common

    def _struct(self, factor: int) -> Any:
        return ctypes.cast(factor, ctypes.POINTER(cholmod._Factor)).contents

    def _permutation(self, factor: int | None) -> I64:
        if not factor:
            raise SolveError(
                "There is not enough memory to prepare this region. Choose a smaller one."
            )
        address = self._struct(factor).perm
        ints = ctypes.cast(address, ctypes.POINTER(ctypes.c_int32))
        return np.ctypeslib.as_array(ints, (self.n,)).astype(np.int64)

    def _trailing(self, c: int) -> F64:
        """Return L_bb, (c, c) lower triangular, from the supernodes that hold it."""
        words = ctypes.cast(
            self._factor + ctypes.sizeof(cholmod._Factor), ctypes.POINTER(ctypes.c_size_t)
        )
        count = int(words[_N_SUPER])
        if not 0 < count <= self.n:
            raise SolveError("This release of CHOLMOD lays its factors out in an unknown way.")
        first, rows_at, values_at = (_ints(words[k], count + 1) for k in (_SUPER, _PI, _PX))
        if first[0] != 0 or first[-1] != self.n or (np.diff(first) <= 0).any():
            raise SolveError("This release of CHOLMOD lays its factors out in an unknown way.")
        rows = _ints(words[_S], int(rows_at[-1]))
        address = self._struct(self._factor).x
        start = self.n - c
        L = np.zeros((c, c))
        # A handful of dense blocks at the end of the factor.
        for k in np.flatnonzero(first[1:] > start):
            ids = rows[rows_at[k] : rows_at[k + 1]]
            width = int(first[k + 1] - first[k])
            block = np.ctypeslib.as_array(
                ctypes.cast(address + 8 * int(values_at[k]), ctypes.POINTER(ctypes.c_double)),
                (width, len(ids)),
            ).T
            columns = np.arange(first[k], first[k + 1])
            inside = columns >= start
            low = ids >= start
            L[np.ix_(ids[low] - start, columns[inside] - start)] = block[np.ix_(low, inside)]
        return np.tril(L)

    def compliance(self) -> F64:
        """Return S = E^T A^-1 E, (c, c), in the order of `last`."""
        inverse = sla.solve_triangular(self._corner, np.eye(len(self._corner)), lower=True)
        unit = inverse[:, self._tail] * self._scale[self._last]
        return np.asarray(unit.T @ unit)

    def answer(self, force: F64) -> F64:
        """Return A^-1 E f for forces f (c,) at the unknowns `last`, (n,).

        Raises
        ------
        SolveError
            There is not enough memory.
        """
        own = np.zeros(len(force))
        own[self._tail] = force * self._scale[self._last]
        load = np.zeros(self.n)
        load[self.n - len(force) :] = sla.solve_triangular(self._corner, own, lower=True)
        dense = cholmod._Dense(self.n, 1, self.n, self.n, load.ctypes.data, None, _REAL, 0)
        common = self._common()
        found = self._lib.cholmod_solve(
            _SOLVE_LT, ctypes.c_void_p(self._factor), ctypes.byref(dense), common
        )
        if not found:
            raise SolveError(
                "There is not enough memory to solve for this region. Choose a smaller one."
            )
        values = ctypes.cast(found, ctypes.POINTER(cholmod._Dense)).contents.x
        x = np.empty(self.n)
        x[self._order] = np.ctypeslib.as_array(
            ctypes.cast(values, ctypes.POINTER(ctypes.c_double)), (self.n,)
        )
        handle = ctypes.c_void_p(found)
        self._lib.cholmod_free_dense(ctypes.byref(handle), common)
        self._lib.cholmod_finish(common)
        return np.asarray(x * self._scale)


def _ints(address: int, count: int) -> I64:
    pointer = ctypes.cast(address, ctypes.POINTER(ctypes.c_int32))
    return np.ctypeslib.as_array(pointer, (count,)).astype(np.int64)


def _release(lib: ctypes.CDLL, factor: int) -> None:
    common = ctypes.create_string_buffer(cholmod._COMMON_BYTES)
    lib.cholmod_start(common)
    handle = ctypes.c_void_p(factor)
    lib.cholmod_free_factor(ctypes.byref(handle), common)
    lib.cholmod_finish(common)
