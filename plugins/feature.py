"""Feature: a click on a groove or a bump sets the level just below it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from plugins.api import (
    F64,
    I64,
    Context,
    Decomposition,
    Document,
    EngineError,
    Gesture,
    Pointer,
    Tool,
    option,
)


@dataclass(frozen=True)
class FeatureOptions:
    """What counts as gone."""

    share: float = option(
        0.6,
        "Gone when",
        "Share of the feature's height that is missing at the level",
        low=0.2,
        high=0.95,
        step=0.05,
        unit="of it is missing",
    )


class Feature(Tool):
    """Sets the level by example."""

    id = "feature"
    title = "Feature"
    tip = "Click on a groove or a bump: the level is set just below it"
    icon = "mdi6.eyedropper-variant"
    shortcut = "E"
    label = "Level by feature"
    order = 25
    repeats = False
    Options = FeatureOptions

    def available(self, document: Document) -> bool:
        """Levels are those of a region."""
        return document.draft.roi is not None

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Act on the release, so that Escape can still call it off."""
        pressed = pointer
        while pointer.kind != "release":
            pointer = yield
        document, known = context.document, context.decomposition
        if known is None or known.k == 0:
            raise EngineError("The modes are not there yet. Wait a moment and click again.")
        hit = context.pick(pressed.x, pressed.y)
        if hit is None or hit.vertex not in known.roi:
            raise EngineError("The click was not on the region. Click on its coloured part.")
        around = np.append(document.mesh.topology.adjacency[[hit.vertex]].indices, hit.vertex)
        rows = np.flatnonzero(np.isin(known.roi, around))
        level = level_below(known, rows, context.options.share)
        return document.with_draft(replace(document.draft, level=level))


def level_below(known: Decomposition, rows: I64, share: float) -> float:
    """Return the highest level at which `share` of the detail at some vertices is missing.

    Parameters
    ----------
    rows : positions in `known.roi` of the vertices looked at.
    share : of the distance between base and original there, 0..1.
    """
    missing = missing_at(known, rows)
    gone = np.flatnonzero(missing >= share * missing[0])
    return known.level_of(int(gone[-1])) if len(gone) else 0.0


def missing_at(known: Decomposition, rows: I64) -> F64:
    """Return how far `surface(k)` is from the original at `rows` for k = 0..known.k, mesh units."""
    steps = known.eta / known.eigenvalues[:, None]
    risen = np.cumsum(known.modes[rows][:, :, None] * steps[None, :, :], axis=1)
    surfaces = known.base[rows][:, None, :] + np.concatenate(
        [np.zeros((len(rows), 1, 3)), risen], axis=1
    )
    away = np.linalg.norm(surfaces - known.original[rows][:, None, :], axis=2)
    return np.asarray(away.mean(axis=0))
