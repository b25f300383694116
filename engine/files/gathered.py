"""Meshes of a scene, each put where the scene places it, gathered into one soup."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from engine.arrays import F64, I64
from engine.files.report import Change
from engine.files.soup import INVALID, Soup, damaged

PLACED = 50_000_000
NODES = 100_000


@dataclass
class Piece:
    """Polygons with their own vertices.

    Parameters
    ----------
    vertices : (n, 3).
    corners : (c,) indices into `vertices`; anything outside of them is kept as `INVALID`.
    sizes : (p,) number of corners of each polygon.
    """

    vertices: F64
    corners: I64
    sizes: I64

    def turned(self) -> Piece:
        """Return the polygons as seen from behind: the corners of each in the opposite order."""
        starts = np.cumsum(self.sizes) - self.sizes
        within = np.arange(len(self.corners)) - np.repeat(starts, self.sizes)
        back = np.repeat(starts + self.sizes - 1, self.sizes) - within
        return Piece(self.vertices, self.corners[back], self.sizes)


def joined(pieces: list[Piece]) -> Piece:
    """Return one piece that holds all of them; equal vertex arrays (the same object) once."""
    offsets: dict[int, int] = {}
    vertices: list[F64] = [np.empty((0, 3))]
    corners: list[I64] = [np.empty(0, np.int64)]
    total = 0
    for piece in pieces:
        if id(piece.vertices) not in offsets:
            offsets[id(piece.vertices)] = total
            vertices.append(piece.vertices)
            total += len(piece.vertices)
        inside = (piece.corners >= 0) & (piece.corners < len(piece.vertices))
        corners.append(np.where(inside, piece.corners + offsets[id(piece.vertices)], INVALID))
    sizes = [np.empty(0, np.int64), *(piece.sizes for piece in pieces)]
    return Piece(np.concatenate(vertices), np.concatenate(corners), np.concatenate(sizes))


@dataclass
class Gathered:
    """What a scene has placed so far.

    Parameters
    ----------
    name : the file's, for refusals.
    """

    name: str
    pieces: list[Piece] = field(default_factory=list)
    _size: int = 0
    _nodes: int = 0

    def place(self, piece: Piece, matrix: F64) -> None:
        """Add `piece` moved by `matrix` (4, 4), x' = M x; one that mirrors turns its polygons.

        Raises
        ------
        FileError
            The matrix is not finite, or all pieces together are more than any model has.
        """
        self._size += 1 + len(piece.vertices) + len(piece.corners)
        self._refuse_multiplied()
        if not np.isfinite(matrix).all():
            raise damaged(self.name, "it places a part by numbers that are not finite")
        if (matrix == np.eye(4)).all():
            self.pieces.append(piece)
            return
        with np.errstate(all="ignore"):
            moved = np.asarray(piece.vertices @ matrix[:3, :3].T + matrix[:3, 3])
            mirrors = float(np.linalg.det(matrix[:3, :3])) < 0
        put = Piece(moved, piece.corners, piece.sizes)
        self.pieces.append(put.turned() if mirrors else put)

    def visit(self) -> None:
        """Note that one more node of the scene is gone through, as often as it is reused."""
        self._nodes += 1
        self._refuse_multiplied()

    def _refuse_multiplied(self) -> None:
        if self._size > PLACED or self._nodes > NODES:
            raise damaged(self.name, "its parts multiply beyond what any model has")

    def soup(self, kind: str, notes: list[Change]) -> Soup:
        """Return all that was placed."""
        whole = joined(self.pieces)
        experimental = Change(
            "experimental", f"{kind} is read experimentally: compare with the original."
        )
        left_out = sum(note.faces for note in notes if note.lost)
        return Soup(
            kind, whole.vertices, whole.corners, whole.sizes, len(whole.vertices),
            len(whole.sizes) + left_out, [experimental, *notes],
        )  # fmt: skip
