"""Array types used throughout, and the one way to freeze an array."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
B1 = NDArray[np.bool_]

_FEW = 512  # among so many times as many places, numbers are sorted; else places are ticked off


def frozen(array: ArrayLike, dtype: Any) -> NDArray[Any]:
    """Return `array` as a C-contiguous read-only array of `dtype`.

    An array that is already so is returned as it is; anything else is copied, so that nobody
    who holds the original can change it afterwards.
    """
    given = np.asarray(array)
    if given.dtype == dtype and given.flags.c_contiguous and not given.flags.writeable:
        return given
    copy = np.array(given, dtype=dtype, order="C")
    copy.flags.writeable = False
    return copy


def distinct(numbers: NDArray[Any], n: int) -> I64:
    """Return the numbers 0..n-1 that there are in an array, ascending, each once.

    What numpy's `unique` gives, which takes thirty times as long for the ids of a large region.
    """
    if _FEW * numbers.size < n:
        return np.unique(numbers).astype(np.int64)
    there = np.zeros(n, dtype=bool)
    there[numbers.ravel()] = True
    return np.flatnonzero(there)
