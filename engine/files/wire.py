"""Messages between the program and its file worker: JSON and plain arrays, nothing executable."""

from __future__ import annotations

import json
import struct
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]

_LENGTH = struct.Struct("<Q")
_DTYPES = {"<f8", "<i8"}
# A longer text is none: something else than messages came through the pipe.
_LONGEST_TEXT = 1 << 30


def send(stream: BinaryIO, message: dict[str, Any], arrays: Arrays | None = None) -> None:
    """Write one message: its length, its JSON text, then the arrays' bytes."""
    given = {
        name: np.ascontiguousarray(a, "<f8" if np.asarray(a).dtype.kind == "f" else "<i8")
        for name, a in (arrays or {}).items()
    }
    layout = [[name, a.dtype.str, list(a.shape)] for name, a in given.items()]
    text = json.dumps({"message": message, "arrays": layout}).encode()
    stream.write(_LENGTH.pack(len(text)) + text)
    for a in given.values():
        stream.write(a.data.cast("B") if a.size else b"")
    stream.flush()


def receive(stream: BinaryIO) -> tuple[dict[str, Any], Arrays]:
    """Read one message.

    Raises
    ------
    EOFError
        The other side is gone, or what comes is no message.
    """
    (length,) = _LENGTH.unpack(_exactly(stream, _LENGTH.size))
    if length > _LONGEST_TEXT:
        raise EOFError("what came through the pipe is no message")
    try:
        head = json.loads(_exactly(stream, length))
    except ValueError as error:
        raise EOFError("what came through the pipe is no message") from error
    arrays: Arrays = {}
    for name, dtype, shape in head["arrays"]:
        if dtype not in _DTYPES:
            raise EOFError(f"array of type {dtype}")
        kind = np.dtype(dtype)
        count = int(np.prod(shape, dtype=np.int64))
        arrays[name] = np.frombuffer(_exactly(stream, count * kind.itemsize), kind).reshape(shape)
    return head["message"], arrays


def _exactly(stream: BinaryIO, count: int) -> bytearray:
    data = bytearray(count)
    view = memoryview(data)
    done = 0
    while done < count:
        got = stream.readinto(view[done:])  # type: ignore[attr-defined]
        if not got:
            raise EOFError("the other side of the pipe is gone")
        done += got
    return data
