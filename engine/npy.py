"""Arrays as the bytes of a `.npy` file, read without trusting a length and without pickle."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.errors import FileError

_DTYPES = ("<f8", "<i8", "<i4", "|b1")


def npy_header(array: NDArray[Any]) -> bytes:
    """Return what stands in front of the bytes of a C-ordered array in a `.npy` file."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(array))
    return header.getvalue()


def npy_array(data: bytes) -> NDArray[Any]:
    """Return the array in the bytes of a `.npy` file, read-only and sharing the bytes.

    Raises
    ------
    FileError
        It is not such a file, is of another type than numbers or booleans of ours, or its length
        is not what it claims.
    """
    stream = io.BytesIO(data)
    try:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise FileError("An array has an unknown version.")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream, max_header_size=1000)
    except (ValueError, SyntaxError, TypeError, KeyError, EOFError, RecursionError) as error:
        raise FileError("An array has a damaged header.") from error
    body = len(data) - stream.tell()
    sane = dtype.str in _DTYPES and not fortran and all(length >= 0 for length in shape)
    if not sane or math.prod(shape) * dtype.itemsize != body:
        raise FileError("An array does not have the type or the size that it claims.")
    return np.frombuffer(data, dtype=dtype, offset=stream.tell()).reshape(shape)
