"""A heavy form in pieces: each is drawn in a moment, all of them one after the other."""

from __future__ import annotations

import numpy as np
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer

from app.viewport.heavy import Heavy
from app.viewport.surface import Surface


class Pieces:
    """The pieces of one surface in a renderer; they are made when they are first drawn.

    Attributes
    ----------
    numbers : which face of the form each face of all pieces is; the last is -1, for none.
    """

    def __init__(self, renderer: vtkRenderer, surface: Surface, heavy: Heavy) -> None:
        self._renderer = renderer
        self._of = surface
        self._parts = heavy.parts
        self.numbers = heavy.numbers
        self._made: list[Surface | None] = [None] * len(heavy.parts)
        self._looked: list[object] = [None] * len(heavy.parts)  # at which positions and colours

    def __len__(self) -> int:
        return len(self._parts)

    @property
    def counts(self) -> tuple[int, ...]:
        """How many faces each piece has."""
        return tuple(len(part.of) for part in self._parts)

    def show(self, which: range) -> None:
        """Let some of the pieces be drawn, as the form is now, and no other."""
        for number, piece in enumerate(self._made):
            if number in which:
                self._as_it_is(number).actor.VisibilityOn()
            elif piece is not None:
                piece.actor.VisibilityOff()

    def actor(self, number: int) -> vtkActor:
        """Return what draws a piece, as the form is now."""
        return self._as_it_is(number).actor

    def remove(self) -> None:
        """Take the pieces out of the picture."""
        for piece in self._made:
            if piece is not None:
                self._renderer.RemoveActor(piece.actor)
        self._made = [None] * len(self._parts)
        self._looked = [None] * len(self._parts)

    def _as_it_is(self, number: int) -> Surface:
        part, piece, of = self._parts[number], self._made[number], self._of
        now = (of.stamp, of.coat)
        if piece is not None and self._looked[number] == now:
            return piece  # only the camera moved
        self._looked[number] = now
        if piece is None:
            piece = Surface(
                of.positions[part.ids],
                part.faces,
                (255, 255, 255),
                normals=of.normals[part.ids],
            )
            piece.colours[:] = of.colours[part.ids]
            piece.actor.SetProperty(of.actor.GetProperty())
            piece.actor.SetShaderProperty(of.actor.GetShaderProperty())
            piece.actor.PickableOff()
            piece.actor.VisibilityOff()
            self._renderer.AddActor(piece.actor)
            self._made[number] = piece
            return piece
        # Looking costs a tenth of sending to OpenGL what has not changed.
        for mine, theirs, tell in (
            (piece.positions, of.positions, piece.moved),
            (piece.normals, of.normals, piece.moved),
            (piece.colours, of.colours, piece.recoloured),
        ):
            new = theirs[part.ids]
            if not np.array_equal(mine, new):
                mine[:] = new
                tell()
        return piece
