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
        (0.0, 3.2), (14.0, 2.9), (22.0, 1.4), (27.0, 0.1), (30.8, 1.5), (31.0, 5.0), (27.2, 10.5),
        (23.6, 18.0), (25.4, 28.0), (34.5, 46.0), (46.0, 68.0), (54.2, 92.0), (55.0, 114.0),
        (46.5, 136.0), (31.5, 154.0), (20.8, 170.0), (16.6, 187.0), (19.0, 204.0), (27.0, 215.2),
        (33.4, 218.6), (36.0, 221.3), (33.6, 223.4), (28.4, 221.4), (19.6, 213.0), (13.6, 200.0),
        (12.2, 186.0), (12.0, 170.0), (9.0, 160.0), (0.0, 156.5),
    ]
)  # fmt: skip
AROUND = 22
FIRST_ROW = 36.0  # height of the lowest row, mm
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
ROW_COUNT = 13


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
        shift = 0.5 * (row // 2 % 2) if row % 2 == 0 else 0.5 * ((row // 2 + 1) % 2)
        across = turn - shift - np.round(turn - shift)
        away = np.hypot(across, (number - row) * 0.84) / 0.46
        height = 0.17 * pitch * bump(away) * outside
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
        form, np.array([-66.0, -66.0, -3.0]), np.array([66.0, 66.0, 227.0]), 1.6, EDGE
    )
    plain = project(FORM.distance, vertices)
    bumps, dimples = studs(vertices)
    height, number = (
        vertices[:, 2],
        ROW_NUMBER(np.clip(FORM.nearest(vertices), 0, ROW_NUMBER.x[-1])),
    )
    front = (vertices[:, 0] > 8) & (height > 44) & (height < 142) & (number > 0)
    return Sample(vertices, faces, plain, {"bumps": bumps, "dimples": dimples}, front)
