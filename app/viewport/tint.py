"""The region's colour, which fades out over the rings around its border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse as sp

from app.look import REGION, Theme, rgb8
from app.viewport.around import crossed, faces_about, renumbered
from app.viewport.surface import summed_at_corners
from engine.arrays import B1, F64, I64, distinct

TINT = 0.46  # how much of the region's violet lies over the clay
FEATHER = 5  # rings of vertices over which the tint fades out
SHOWN = 0.85  # share of a region that must look like it


@dataclass(frozen=True, eq=False)
class Feather:
    """How strong the tint of a region is.

    Parameters
    ----------
    inside : (n,) the region.
    weight : (n,) float32, 1 in the region and 0 outside, in between near its border.
    border : (b,) ids of the vertices near the border, where it is in between.
    faces : (g, 3) the faces around those.
    """

    inside: B1
    weight: NDArray[np.float32]
    border: I64
    faces: I64


def feathered(
    ids: I64, faces: I64, incidence: sp.csr_array, n: int, rounds: int = FEATHER
) -> Feather:
    """Return the tint of the region `ids`, which fades out over some rings around its border.

    Each round averages over the faces around a vertex. Only how the border looks, never what the
    region is: where so many rounds would hide a part of it, as of a dozen vertices, it is fewer.
    """
    tint = _feathered(ids, faces, incidence, n, rounds)
    while rounds and len(ids) and float((tint.weight[ids] > 0.5).mean()) < SHOWN:
        rounds //= 2
        tint = _feathered(ids, faces, incidence, n, rounds)
    return tint


def _feathered(ids: I64, faces: I64, incidence: sp.csr_array, n: int, rounds: int) -> Feather:
    inside = np.zeros(n, dtype=bool)
    inside[ids] = True
    few = ids if 2 * len(ids) <= n else np.flatnonzero(~inside)
    about = crossed(inside, few, faces, incidence)
    for _ in range(rounds - 1):
        about = faces_about(distinct(faces[about], n), incidence)
    free = distinct(faces[about], n)
    near = faces[faces_about(free, incidence)]
    weight = inside.astype(np.float32)
    if len(free):
        used = distinct(near, n)
        corners = renumbered(near, used, n)
        may_change = np.zeros(len(used), dtype=bool)
        may_change[renumbered(free, used, n)] = True
        weight[free] = _averaged(inside[used], may_change, corners, rounds)[may_change]
    return Feather(inside, weight, free, near)


def changed(before: Feather, after: Feather) -> I64:
    """Return the vertices whose weight may be another in another tint of the same form."""
    other = before.inside != after.inside
    other[before.border] = True
    other[after.border] = True
    return np.flatnonzero(other)


def _averaged(inside: B1, free: B1, faces: I64, rounds: int) -> F64:
    """Return the weights (v,) of vertices after some rounds in which the free ones are averaged."""
    weight = inside.astype(np.float64)
    count = np.bincount(faces.ravel(), minlength=len(inside))
    for _ in range(rounds):
        mean = (weight[faces[:, 0]] + weight[faces[:, 1]] + weight[faces[:, 2]]) / 3
        summed = summed_at_corners(faces, mean[:, None], len(inside))[:, 0]
        weight = np.where(free, summed / count, weight)
    return weight


def tinted(weight: NDArray[np.float32], theme: Theme) -> NDArray[np.uint8]:
    """Return the colours (m, 3) of vertices by their weight (m,): held at 0, in the region at 1."""
    base, held, violet = (
        np.asarray(rgb8(colour), dtype=np.float32) for colour in (theme.clay, theme.held, REGION)
    )
    full = (1 - TINT) * base + TINT * violet
    return (held + weight[:, None] * (full - held) + 0.5).astype(np.uint8)
