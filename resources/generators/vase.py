"""The vase of Fig. 12: a turned form whose belly carries rows of bumps and of dimples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial import cKDTree

from resources.generators.remesh import Points, mesh_form, project
from resources.generators.sample import Sample
from resources.generators.solids import bump

# Radius and height of the turned outline, from the middle of the underside to the well's bottom.
OUTLINE = np.array(
    [
        (0.0, 3.2), (14.0, 2.9), (21.0, 1.4), (25.5, 0.1), (29.0, 1.4), (29.2, 4.6), (25.6, 10.0),
        (21.6, 18.0), (22.6, 28.0), (30.5, 45.0), (42.5, 68.0), (51.6, 92.0), (53.4, 113.0),
        (46.6, 134.0), (33.0, 152.0), (21.6, 169.0), (15.8, 187.0), (16.2, 204.0), (22.5, 217.0),
        (28.0, 220.8), (30.6, 223.6), (28.4, 225.8), (23.6, 223.6), (16.6, 215.0), (12.2, 203.0),
        (11.2, 187.0), (11.0, 172.0), (8.2, 162.5), (0.0, 159.0),
    ]
)  # fmt: skip
AROUND = 20
ROW_COUNT = 13
TWIST = 0.125  # how far each row is turned against the one below, beside the half pitch
FIRST_ROW = 37.0  # height of the lowest row, mm
EDGE = 1.6


class Turned:
    """A turned form: signed distance and arc length of the outline's nearest point."""

    def __init__(self, outline: NDArray[np.float64]) -> None:
        chord = np.r_[0, np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))]
        # The outline starts and ends level, so that the form is smooth on its axis.
        level = ((1, np.array([1.0, 0.0])), (1, np.array([-1.0, 0.0])))
        self._curve = CubicSpline(chord, outline, bc_type=level)
        self._t = np.linspace(0, chord[-1], 20000)
        self._tree = cKDTree(self._curve(self._t))

    def nearest(self, p: Points) -> NDArray[np.float64]:
        """Return the outline's parameter nearest to each point, refined by two Newton steps."""
        flat = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
        t = self._t[self._tree.query(flat)[1]]
        for _ in range(2):
            off = self._curve(t) - flat
            first, second = self._curve(t, 1), self._curve(t, 2)
            slope = (first**2).sum(axis=1) + (off * second).sum(axis=1)
            step = (off * first).sum(axis=1) / np.maximum(slope, 0.05)
            t = np.clip(t - np.clip(step, -0.05, 0.05), 0, self._t[-1])
        return np.asarray(t)

    def distance(self, p: Points) -> NDArray[np.float64]:
        """Return the signed distance, positive to the right of the outline's direction."""
        t = self.nearest(p)
        flat = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
        off = flat - self._curve(t)
        along = self._curve(t, 1)
        side = off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
        return np.asarray(np.copysign(np.linalg.norm(off, axis=1), side))

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return radius and height at outline parameters, (n, 2)."""
        return np.asarray(self._curve(t))


FORM = Turned(OUTLINE)


def _rows() -> tuple[NDArray[np.float64], PchipInterpolator]:
    """Return the outline parameters of the rows and the row number as a function of them.

    Rows are spaced in proportion to the radius, so that every bump has the same shape.
    """
    t = np.linspace(0, 320, 6000)
    radius, height = FORM.at(t).T
    outside = t < t[np.argmax(height)]
    t, radius, height = t[outside], radius[outside], height[outside]
    first = np.searchsorted(height[200:], FIRST_ROW) + 200
    pitch = 2 * np.pi / AROUND * radius * 0.84
    number = np.r_[0, np.cumsum(np.diff(t) / (0.5 * (pitch[1:] + pitch[:-1])))]
    number -= number[first]
    return t, PchipInterpolator(t, number)


_, ROW_NUMBER = _rows()


def studs(p: Points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the heights of the bumps and (negative) of the dimples at points, mm."""
    t = FORM.nearest(p)
    radius = FORM.at(t)[:, 0]
    number = np.clip(ROW_NUMBER(np.clip(t, 0, ROW_NUMBER.x[-1])), -2, ROW_COUNT + 1)
    outside = (t < 300) & (p[:, 2] > 15)
    turn = np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi) * AROUND
    bumps, dimples = np.zeros(len(p)), np.zeros(len(p))
    pitch = 2 * np.pi / AROUND * radius
    for row in range(ROW_COUNT):
        shift = (0.5 + TWIST) * row
        across = turn - shift - np.round(turn - shift)
        away = np.hypot(across, (number - row) * 0.84) / 0.45
        height = 0.165 * pitch * bump(away, 2.0) * outside
        if row % 2 == 0:
            bumps += height
        else:
            dimples -= 0.8 * height
    return bumps, dimples


def form(p: Points) -> NDArray[np.float64]:
    """Return the implicit form of the whole vase."""
    return FORM.distance(p) - sum(studs(p))


def make() -> Sample:
    """Return the vase."""
    vertices, faces = mesh_form(
        form, np.array([-66.0, -66.0, -3.0]), np.array([66.0, 66.0, 229.0]), 1.6, EDGE
    )
    plain = project(FORM.distance, vertices)
    bumps, dimples = studs(vertices)
    height, number = (
        vertices[:, 2],
        ROW_NUMBER(np.clip(FORM.nearest(vertices), 0, ROW_NUMBER.x[-1])),
    )
    front = (vertices[:, 0] > 20) & (height > 44) & (height < 140) & (number > 0)
    return Sample(vertices, faces, plain, {"bumps": bumps, "dimples": dimples}, front)
