"""Nonsense: what no tool may make of a document is refused before anybody sees it."""

from __future__ import annotations

import numpy as np

from app.toolbox import ToolFailedError
from engine import Document, Draft, EngineError, SketchEdit, Source

KEPT = ("original", "mesh", "recipe")  # of a document; only a step changes these


class NonsenseError(ToolFailedError):
    """A tool returned something that is neither a document, a step nor None."""


def refuse_nonsense(before: Document, after: Document) -> None:
    """Refuse a document that no tool may make of `before`.

    Raises
    ------
    NonsenseError
    """
    kept = all(getattr(after, name) is getattr(before, name) for name in KEPT)
    if not kept:
        raise NonsenseError("it changed the mesh without a step")
    draft = after.draft
    if not isinstance(draft, Draft):
        raise NonsenseError("its draft is none")
    if draft.roi is not before.draft.roi and draft.roi is not None:
        _refuse_ids(draft.roi, before.mesh.n, "its region")
    if draft.source is not None and draft.source is not before.draft.source:
        if not isinstance(draft.source, Source):
            raise NonsenseError("its source is none")
        _refuse_ids(np.sort(draft.source.anchors), before.mesh.n, "its source")
    try:
        SketchEdit(np.zeros(0, np.int64), draft.level, draft.strokes, draft.options).check(
            before.mesh
        )
    except (EngineError, AttributeError, TypeError, ValueError) as error:
        raise NonsenseError(f"its draft cannot be solved: {error}") from error


def _refuse_ids(ids: object, n: int, what: str) -> None:
    good = isinstance(ids, np.ndarray) and ids.ndim == 1 and ids.dtype.kind in "iu" and len(ids)
    if not good:
        raise NonsenseError(f"{what} is not an array of vertex ids")
    assert isinstance(ids, np.ndarray)
    if ids.min() < 0 or ids.max() >= n or (np.diff(ids) <= 0).any():
        raise NonsenseError(f"{what} is not ascending vertex ids below {n}")
