"""Drafting: what becomes of a draft when a person goes one step back, or edits symmetrically."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import engine
from engine import Document, Draft, Source
from engine.arrays import I64, frozen


def one_step_back(document: Document) -> tuple[Document, str] | None:
    """Return the document without what was drawn last, and what the history says about it.

    That is the source, else the last target, else the region; None when nothing is drawn.
    """
    draft = document.draft
    if draft.roi is None:
        return None
    if draft.source is not None:
        return document.with_draft(replace(draft, source=None)), "Source dropped"
    if draft.strokes:
        *kept, last = draft.strokes
        source = Source(last.anchors, last.view, last.closed, last.weights, last.outline)
        back = replace(draft, source=source, strokes=tuple(kept))
        return document.with_draft(back), "Target dropped"
    return document.with_draft(draft.with_roi(None)), "Region left"


def resized(draft: Draft, roi: I64 | None) -> Draft:
    """Return the draft on a region made of its own; what was drawn stays if it lies on that too."""
    curves = [*draft.strokes] + ([] if draft.source is None else [draft.source])
    on_it = roi is not None and all(
        np.isin(curve.anchors, roi, kind="table").all() for curve in curves
    )
    return replace(draft, roi=roi) if on_it else draft.with_roi(roi)


def on_both_sides(document: Document, before: Document) -> Document:
    """Return the document with its region mirrored, when symmetry is on and one of them is new."""
    draft, mirror = document.draft, document.draft.options.mirror
    if draft.roi is None or not mirror:
        return document
    if before.draft.roi is draft.roi and before.draft.options.mirror == mirror:
        return document
    both = engine.mirrored_region(document.mesh, draft.roi, mirror)
    if len(both) == len(draft.roi):
        return document
    return document.with_draft(replace(draft, roi=frozen(both, np.int64)))
