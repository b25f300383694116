"""Files of checked records that only grow: a half-written or damaged record costs itself alone.

A record is its head (mark, kind, length, check sum of the payload, check sum of the head) and its
payload. A reader goes over what does not check and takes up again at the next mark.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

MARK = b"\xe1gnF"
_FIELDS = struct.Struct("<4sBQI")
_HEAD_SUM = struct.Struct("<I")
HEAD = _FIELDS.size + _HEAD_SUM.size
DAMAGED = -1
"""The kind that stands for bytes that are no record; not for an end that was only half written."""


def append_record(file: BinaryIO, kind: int, payload: bytes) -> None:
    """Write one record at the end of an unbuffered file.

    Parameters
    ----------
    file : open for appending.
    kind : 0 to 255, for the reader.
    payload : the bytes.
    """
    fields = _FIELDS.pack(MARK, kind, len(payload), zlib.crc32(payload))
    data = fields + _HEAD_SUM.pack(zlib.crc32(fields)) + payload
    view = memoryview(data)
    # An unbuffered write may take a part only (a signal, a disk that is nearly full).
    while view:
        view = view[file.write(view) :]


def read_records(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield (kind, payload) of every whole record of a file, in order, and `DAMAGED` in between."""
    size = path.stat().st_size
    with path.open("rb") as file:
        at = 0
        while at + HEAD <= size:
            file.seek(at)
            found = _parsed(file.read(HEAD))
            if found is not None:
                kind, length, total = found
                if at + HEAD + length > size:
                    at = _next_mark(file, at + 1)
                    continue
                payload = file.read(length)
                if zlib.crc32(payload) == total:
                    yield kind, payload
                    at += HEAD + length
                    continue
            yield DAMAGED, b""
            at = _next_mark(file, at + 1)


def _parsed(head: bytes) -> tuple[int, int, int] | None:
    if len(head) < HEAD or not head.startswith(MARK):
        return None
    if _HEAD_SUM.unpack_from(head, _FIELDS.size)[0] != zlib.crc32(head[: _FIELDS.size]):
        return None
    _, kind, length, total = _FIELDS.unpack_from(head)
    return kind, length, total


def _next_mark(file: BinaryIO, start: int) -> int:
    """Return where the next mark stands at or after `start`; the end of the file if nowhere."""
    block = 2**20
    file.seek(start)
    data = file.read(block)
    while data:
        found = data.find(MARK)
        if found >= 0:
            return start + found
        if len(data) < block:
            return start + len(data) + HEAD
        # A mark may lie across the border of two blocks.
        start += len(data) - len(MARK) + 1
        file.seek(start)
        data = file.read(block)
    return start + HEAD
