"""The region's colour, which fades out over the rings around its border."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.look import REGION, Theme, rgb8
from app.viewport.surface import summed_at_corners
from engine.arrays import I64

TINT = 0.46  # how much of the region's violet lies over the clay
FEATHER = 5  # rings of vertices over which the tint fades out


def feathered(inside: NDArray[np.bool_], faces: I64, rounds: int = FEATHER) -> NDArray[np.float32]:
    """Return a weight (n,) that falls from 1 in the region to 0 outside over some rings.

    Each round averages over the faces around a vertex. Only how the border looks, never what the
    region is.
    """
    weight = inside.astype(np.float64)
    corners = inside[faces]
    touched = np.zeros(len(inside), dtype=bool)
    touched[faces[corners.any(axis=1) & ~corners.all(axis=1)].ravel()] = True
    for _ in range(rounds - 1):
        touched[faces[touched[faces].any(axis=1)].ravel()] = True
    near = faces[touched[faces].any(axis=1)]
    if len(near) == 0:
        return weight.astype(np.float32)
    used = np.unique(near)
    local = np.searchsorted(used, near)
    count = np.bincount(local.ravel(), minlength=len(used))
    free = touched[used]
    w = weight[used]
    for _ in range(rounds):
        mean = summed_at_corners(local, w[local].mean(axis=1)[:, None], len(used))[:, 0] / count
        w = np.where(free, mean, w)
    weight[used] = w
    return weight.astype(np.float32)


def tinted(weight: NDArray[np.float32], theme: Theme) -> NDArray[np.uint8]:
    """Return the colours (m, 3) of vertices by their weight (m,): held at 0, in the region at 1."""
    base, held, violet = (
        np.asarray(rgb8(colour), dtype=np.float32) for colour in (theme.clay, theme.held, REGION)
    )
    full = (1 - TINT) * base + TINT * violet
    return (held + weight[:, None] * (full - held) + 0.5).astype(np.uint8)
