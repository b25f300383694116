"""What a target in a view asks of anchors: rows of Eq. 17, exact in perspective."""

from __future__ import annotations

import numpy as np

from engine.arrays import F64, I64
from engine.errors import SketchError
from engine.handles import Rows
from engine.view import View

# Targets closer to their anchors than this many pixels ask for nothing.
_STILL_PX = 1e-7


def seen(view: View, points: F64) -> F64:
    """Return the pixels (c, 2) where points (c, 3) are seen.

    Raises
    ------
    SketchError
        A point is behind the camera.
    """
    if not (view.depth(points) > 0).all():
        raise SketchError(
            "A part of the source curve lies behind the camera. Draw it in front of the camera."
        )
    return view.project(points)


def sight_rows(view: View, points: F64, way: F64, scale: float, which: I64, weights: F64) -> Rows:
    """Return two rows an anchor that ask it to be seen `way` px from where it is.

    The line of sight of a pixel (u, v) lies in two planes, (P1 - u P3) x = 0 and
    (P2 - v P3) x = 0. Each is divided by the length of its normal, so that it measures a distance.

    Parameters
    ----------
    view : the camera.
    points : (c, 3) the anchors at rest, mesh units.
    way : (c, 2) px.
    scale : mesh units in a unit of the rows' distances.
    which : (c,) the anchors' places in the list of anchors.
    weights : (c,) in (0, 1].

    Raises
    ------
    SketchError
        An anchor lies behind the camera, or a target at the eye itself.

    Source: Orbay et al. 2012, Eq. 17.
    """
    here = seen(view, points)
    uv = here + way
    P = view.pixel_matrix
    planes = P[None, :2] - uv[:, :, None] * P[2]
    size = np.linalg.norm(planes[:, :, :3], axis=2)
    if not (size > 0).all():
        raise SketchError("A target lies behind the eye. Draw it in front of the camera.")
    homogeneous = np.column_stack([points, np.ones(len(points))])
    away = np.einsum("cra,ca->cr", planes, homogeneous) / size / scale
    away[np.linalg.norm(way, axis=1) <= _STILL_PX] = 0.0
    return Rows(
        np.repeat(which, 2),
        (planes[:, :, :3] / size[:, :, None]).reshape(-1, 3),
        -away.ravel(),
        np.repeat(1.0 / weights - 1.0, 2),
    )


def depth_rows(view: View, which: I64, hold: float) -> Rows:
    """Return one weak row an anchor that holds its distance from the eye; none for `hold` 0.

    Parameters
    ----------
    view : the camera that the stroke was drawn in.
    which : (c,) the anchors' places in the list of anchors.
    hold : weight in units of the surface's own stiffness at the anchor.
    """
    if hold <= 0:
        which = which[:0]
    c = len(which)
    direction = np.broadcast_to(sight_direction(view), (c, 3))
    return Rows(which, direction, np.zeros(c), np.full(c, 1.0 / max(hold, 1e-300)))


def sight_direction(view: View) -> F64:
    """Return the unit direction that the middle of the viewport looks along, (3,).

    It is where the two sight planes of the middle pixel meet, which holds for parallel projections
    as for perspective ones.

    Raises
    ------
    SketchError
        The view's matrix squeezes space to a plane, so that it looks nowhere.
    """
    P = view.pixel_matrix
    u, v = view.size[0] / 2, view.size[1] / 2
    along = np.cross((P[0] - u * P[2])[:3], (P[1] - v * P[2])[:3])
    size = float(np.linalg.norm(along))
    if not size > 0:
        raise SketchError("The view has no depth. Draw the stroke again in another view.")
    return np.asarray(along / size)
