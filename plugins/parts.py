"""A region taken apart and remembered: a live preview asks for it again and again."""

from __future__ import annotations

from engine import Decomposition, Memo, Mesh, Run, decompose, decompose_until
from engine.arrays import I64

KEPT = 2  # decompositions are large


def taken_apart(
    mesh: Mesh, roi: I64, level: float | None = None, run: Run | None = None
) -> Decomposition:
    """Return the decomposition of a region, with the modes that `level` needs or, for None, all.

    What was worked out for the same mesh, region and level comes from `run.memo`; the bits are
    those of `decompose_until` and `decompose`.
    """
    run = run or Run()
    kept: Memo = run.memo.get("regions taken apart", lambda: Memo(KEPT))
    key = (mesh.digest, roi.tobytes(), level)
    if level is None:
        return kept.get(key, lambda: decompose(mesh, roi, run=run))
    return kept.get(key, lambda: decompose_until(mesh, roi, level, run=run))
