"""The shipped meshes, read by a reader independent of the program's own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Reader = Callable[[Path], tuple[np.ndarray, np.ndarray]]


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) float64 and faces (f, 3) int64."""
    content = path.read_bytes()
    head, _, body = content.partition(b"end_header\n")
    words = head.decode("ascii").split()
    counts = [int(words[i + 2]) for i, word in enumerate(words) if word == "element"]
    vertices = np.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3)
    row = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    faces = np.frombuffer(body, row, offset=vertices.nbytes)
    assert len(faces) == counts[1]
    assert (faces["count"] == 3).all()
    return vertices.astype(np.float64), faces["corners"].astype(np.int64)


@pytest.fixture(name="read_ply", scope="session")
def reader() -> Reader:
    """Return a function from a path to vertices (n, 3) and faces (f, 3)."""
    return read_ply
