"""Array types used throughout, and the one way to freeze an array."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
B1 = NDArray[np.bool_]


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
