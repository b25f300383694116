"""What the engine says when it cannot go on: the fact and the remedy, in plain words."""

from __future__ import annotations


class EngineError(Exception):
    """A condition the person can do something about.

    The message is one sentence with the fact and one with the remedy; it is shown as it stands.
    """


class MeshError(EngineError):
    """The vertex and face arrays do not form a mesh."""


class PositionsError(MeshError):
    """Positions are not finite, or not one for each vertex."""


class RegionError(EngineError):
    """The region of interest cannot be decomposed or edited as it is."""


class SolveError(EngineError):
    """A linear or eigenvalue solve gave no trustworthy result."""


class SketchError(EngineError):
    """A stroke cannot be turned into anchors or a target."""


class FileError(EngineError):
    """A file cannot be read or written; the message names the file."""


class RecipeError(EngineError):
    """A recipe cannot be read or replayed."""


class Cancelled(EngineError):
    """The person asked the running job to stop."""

    def __init__(self, message: str = "The work was cancelled.") -> None:
        super().__init__(message)
