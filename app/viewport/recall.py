"""The eye that a kept view was taken with."""

from __future__ import annotations

import math

import numpy as np

from app.viewport.camera import HALF_STEEPNESS, Eye
from app.viewport.surface import Placement
from engine.view import View


def eye_from(view: View, placement: Placement, up: int) -> Eye:
    """Return where `view` looks from, in scene coordinates.

    A view holds a matrix only: w grows along the line of sight, and the eye of a perspective one is
    where x, y and w vanish. Its middle is put beside the scene's origin, so that turning goes on
    about the form.

    Parameters
    ----------
    up : index of the up axis, 2 for z, 1 for y.
    """
    x, y, _, w = view.matrix @ np.linalg.inv(placement.matrix)
    right = x[:3] / np.linalg.norm(x[:3])
    perspective = bool(np.linalg.norm(w[:3]) > 1e-12 * np.linalg.norm(y[:3]))
    if perspective:
        forward = w[:3] / np.linalg.norm(w[:3])
        rows, offsets = np.stack([x[:3], y[:3], w[:3]]), np.array([x[3], y[3], w[3]])
        position = np.linalg.solve(rows, -offsets)
        distance = max(float(-position @ forward), 1e-3)
        centre = position + distance * forward
    else:
        forward = np.cross(y[:3], x[:3])
        forward /= np.linalg.norm(forward)
        rows, offsets = np.stack([x[:3], y[:3], forward]), np.array([x[3], y[3], 0.0])
        centre = np.linalg.solve(rows, -offsets)
        distance = float(w[3] / np.linalg.norm(y[:3])) / HALF_STEEPNESS
    height = -forward[up]
    across = right[1] if up == 2 else -right[2]
    return Eye(
        centre,
        distance,
        math.atan2(across, right[0]),
        math.asin(min(1.0, max(-1.0, float(height)))),
        perspective,
        up,
    )
