"""Rows of numbers as text, a block at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from engine.arrays import F64, I64

_BLOCK = 50_000


def formatted(line: str, rows: F64 | I64) -> Iterator[bytes]:
    """Give the text of `rows`, each through the format `line`, in blocks of bounded size."""
    for block in np.array_split(rows, max(1, len(rows) // _BLOCK)):
        yield ((line * len(block)) % tuple(block.ravel().tolist())).encode("ascii")
