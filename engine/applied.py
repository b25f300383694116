"""One step applied and its result looked at: a step may be a stranger's."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from engine.edit import SketchEdit
from engine.errors import EngineError, PositionsError
from engine.mesh import Mesh
from engine.run import Run

if TYPE_CHECKING:
    from engine.recipe import Step

log = logging.getLogger(__name__)

# What is so many diagonals away was not meant, and no renderer can show it.
_FARTHEST = 1e4


class StepError(EngineError):
    """A step of a plugin raised or gave no mesh that it could have given.

    Parameters
    ----------
    step : the step.
    reason : what it did, after "it".
    """

    def __init__(self, step: Step, reason: str) -> None:
        self.step = step
        self.reason = reason
        super().__init__(
            f"The step “{_name(step)}” failed: it {reason}. Nothing was changed; tell its author, "
            "or go on without it."
        )


def applied(step: Step, mesh: Mesh, run: Run | None = None) -> Mesh:
    """Return what `step` makes of `mesh`, checked.

    Equal faces come back as the same object, so that a plugin that copies them costs nothing.

    Raises
    ------
    StepError
        A plugin's step raised what is no `EngineError`, or returned something else than a mesh,
        positions that are not finite or out of reach, or other vertices on the same faces.
    EngineError
        The step says itself that it cannot be done.
    """
    try:
        result: object = step.apply(mesh, run)
    except PositionsError as error:
        raise StepError(step, f"gave positions that are none ({error})") from error
    except EngineError:
        raise
    except (Exception, SystemExit) as error:
        if isinstance(step, SketchEdit):
            raise
        log.info("The step %s raised", step.kind, exc_info=True)
        raise StepError(step, f"raised {type(error).__name__}: {error}") from error
    if not isinstance(result, Mesh):
        raise StepError(step, f"returned {type(result).__name__}, not a mesh")
    wrong = _what_is_wrong(mesh, result)
    if wrong:
        raise StepError(step, wrong)
    same = result.faces is mesh.faces
    if not same and np.array_equal(result.faces, mesh.faces):
        return mesh.with_vertices(result.vertices)
    return result


def _what_is_wrong(before: Mesh, after: Mesh) -> str:
    x, faces = np.asarray(after.vertices), np.asarray(after.faces)
    if x.ndim != 2 or x.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        return "returned arrays that are no mesh"
    if after.n != before.n and np.array_equal(faces, before.faces):
        return f"returned {after.n} vertices on the faces of {before.n}"
    if faces.min() < 0 or faces.max() >= len(x):
        return "returned faces that refer to vertices that are not there"
    if not np.isfinite(x).all():
        return "returned positions that are not finite numbers"
    if np.abs(x - before.bounds.mean(axis=0)).max() > _FARTHEST * before.diagonal:
        return "returned positions out of all reach"
    return ""


def _name(step: Step) -> str:
    return str(getattr(step, "title", "") or step.kind)
