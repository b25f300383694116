"""Soup: what a scanner found in a file, and how it settles into triangles to be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from engine.arrays import B1, F64, I64
from engine.errors import FileError
from engine.files.polygons import triangulate
from engine.files.report import Change, counted

INVALID = np.int64(-(2**62))
LARGEST = 1e36
SMALLEST = 1e-30
MOST_CORNERS = 20_000


@dataclass
class Soup:
    """Vertices and polygons exactly as the file numbers them.

    Parameters
    ----------
    format : "OBJ", ...
    vertices : (n, 3) float64; NaN where the file's numbers cannot be read.
    corners : (c,) int64 vertex indices from 0, all polygons one after the other; `INVALID` where
        unreadable.
    sizes : (p,) number of corners of each polygon.
    declared_vertices, declared_faces : what the file says it holds.
    notes : what was noticed while scanning.
    """

    format: str
    vertices: F64
    corners: I64
    sizes: I64
    declared_vertices: int
    declared_faces: int
    notes: list[Change] = field(default_factory=list)


def damaged(name: str, fact: str) -> FileError:
    """Return the refusal of a file that contradicts itself."""
    return FileError(
        f"“{name}” is damaged: {fact}. Export the model again or get another copy of the file."
    )


def settle(soup: Soup, name: str) -> tuple[F64, I64, list[Change]]:
    """Return vertices (n, 3), triangles (f, 3) and all notes; every loss is among the notes.

    Polygons with fewer than three corners, with an index that no vertex has, or with a corner whose
    coordinates are not finite are left out, and so are the vertices that are not finite.

    Raises
    ------
    FileError
        No face is left, or more than half of them would be lost.
    """
    notes = list(soup.notes)
    n = len(soup.vertices)
    finite = np.asarray(np.isfinite(soup.vertices).all(axis=1))
    short = np.asarray(soup.sizes < 3)
    outside = (soup.corners < 0) | (soup.corners >= n)
    broken = _any_in_polygon(outside, soup.sizes) & ~short
    unplaced = np.zeros(len(soup.corners), dtype=bool)
    unplaced[~outside] = ~finite[soup.corners[~outside]]
    homeless = _any_in_polygon(unplaced, soup.sizes) & ~short & ~broken
    keep = ~(short | broken | homeless)

    _refuse_hopeless(soup, name, keep, broken, homeless)
    if short.any():
        k = int(short.sum())
        notes.append(
            Change(
                "few_corners",
                f"{counted(k, 'face')} with fewer than three corners left out.",
                faces=k,
                lost=True,
            )
        )
    if broken.any():
        k = int(broken.sum())
        refers = "refers" if k == 1 else "refer"
        notes.append(
            Change(
                "bad_index",
                f"{counted(k, 'face')} left out that {refers} to vertices which the file does "
                "not have.",
                faces=k,
                lost=True,
            )
        )
    if homeless.any() or not finite.all():
        lost_v, lost_f = int((~finite).sum()), int(homeless.sum())
        notes.append(
            Change(
                "not_finite",
                f"{counted(lost_v, 'vertex')} left out because a coordinate is not a finite "
                f"number, and {counted(lost_f, 'face')} at them.",
                lost_v,
                lost_f,
                lost=True,
            )
        )
    corners = soup.corners[np.repeat(keep, soup.sizes)]
    sizes = soup.sizes[keep]
    vertices = soup.vertices
    if not finite.all():
        renumbered = np.cumsum(finite) - 1
        corners = renumbered[corners]
        vertices = vertices[finite]
    _refuse_size(vertices[corners], name)
    big = int((sizes > 3).sum())
    if big:
        notes.append(
            Change(
                "polygons",
                f"{counted(big, 'polygon')} with more than three corners split into triangles.",
            )
        )
    return vertices, triangulate(vertices, corners, sizes), notes


def _refuse_hopeless(soup: Soup, name: str, keep: B1, broken: B1, homeless: B1) -> None:
    if soup.sizes.max(initial=0) > MOST_CORNERS:
        raise FileError(
            f"“{name}” has a polygon with {int(soup.sizes.max()):,} corners; "
            f"{MOST_CORNERS:,} are the most that are read. Triangulate the model where it was made."
        )
    if len(soup.vertices) == 0 or len(soup.sizes) == 0:
        what = "no vertices" if len(soup.vertices) == 0 else "no faces"
        raise FileError(
            f"“{name}” holds {what}, so there is no surface to open. "
            "Export the model again as a triangle mesh."
        )
    if keep.sum() * 2 >= len(keep):
        return
    if homeless.sum() >= broken.sum():
        why = "have a corner whose coordinates are not finite numbers"
    else:
        why = "refer to vertices that the file does not have"
    raise FileError(
        f"“{name}” is damaged: {int((~keep).sum()):,} of its {counted(len(keep), 'face')} {why} "
        "or lack corners. Export the model again or get another copy of the file."
    )


def _refuse_size(used: F64, name: str) -> None:
    """Refuse coordinates whose products leave what floating point numbers can hold."""
    low, high = used.min(axis=0), used.max(axis=0)
    largest = float(np.abs(used).max())
    extent = float((high / 2 - low / 2).max()) * 2
    if largest > LARGEST or not extent >= SMALLEST:
        fact = (
            f"coordinates up to {largest:.3g}" if largest > LARGEST else f"a size of {extent:.3g}"
        )
        raise FileError(
            f"“{name}” has {fact}, beyond what can be computed with. "
            "Scale the model to an ordinary size where it was made, and export it again."
        )


def _any_in_polygon(marked: B1, sizes: I64) -> B1:
    """Return for every polygon whether one of its corners is marked."""
    total = np.concatenate([np.zeros(1, np.int64), np.cumsum(marked)])
    ends = np.cumsum(sizes)
    return np.asarray(total[ends] - total[ends - sizes] > 0)
