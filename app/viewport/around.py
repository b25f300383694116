"""What lies around some vertices of a form, found without looking through all of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse as sp

from engine.arrays import B1, F64, I64, distinct


def differing(a: F64, b: F64) -> I64:
    """Return the numbers of the rows in which arrays (n, 3) differ, ascending."""
    return distinct(np.flatnonzero(a != b) // 3, len(a))


def faces_about(ids: I64, incidence: sp.csr_array) -> I64:
    """Return the faces around the vertices `ids`, ascending, each once.

    Parameters
    ----------
    incidence : (n, f), which faces are around a vertex.
    """
    place = ranges(incidence.indptr[ids], incidence.indptr[ids + 1])
    return distinct(incidence.indices[place], incidence.shape[1])


def ranges(start: NDArray[Any], end: NDArray[Any]) -> I64:
    """Return start[0] .. end[0] - 1, then start[1] .. end[1] - 1, and so on; no end is before."""
    count = end - start
    total = np.cumsum(count)
    if len(total) == 0:
        return np.zeros(0, dtype=np.int64)
    return np.asarray(np.arange(total[-1]) + np.repeat(start - (total - count), count))


def crossed(inside: B1, few: I64, faces: I64, incidence: sp.csr_array) -> I64:
    """Return the faces that have some of their corners in a part of the form and some outside.

    Parameters
    ----------
    inside : (n,) the part.
    few : ids of the part or of all the rest, whichever are fewer.
    """
    about = faces_about(few, incidence)
    corners = faces[about]
    a, b, c = (inside[corners[:, k]] for k in range(3))
    return about[(a != b) | (b != c)]


def renumbered(corners: I64, ids: I64, n: int) -> I64:
    """Return `corners` in positions of `ids`, which holds all of them, of a form of n vertices."""
    place = np.empty(n, dtype=np.int64)
    place[ids] = np.arange(len(ids))
    return place[corners]
