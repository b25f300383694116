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
ROW_PITCH, REACH, HEIGHT = 0.84, 0.45, 0.165  # in units of the pitch around
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

    def distance(
        self, p: Points, nearest: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Return the signed distance, positive to the right of the outline's direction."""
        t = self.nearest(p) if nearest is None else nearest
        flat = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
        off = flat - self._curve(t)
        along = self._curve(t, 1)
        side = off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
        return np.asarray(np.copysign(np.linalg.norm(off, axis=1), side))

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return radius and height at outline parameters, (n, 2)."""
        return np.asarray(self._curve(t))


FORM = Turned(OUTLINE)


def _rows() -> PchipInterpolator:
    """Return the row number as a function of the outline's parameter, up to the lip.

    Rows are spaced in proportion to the radius, so that every bump has the same shape.
    """
    t = np.linspace(0, 320, 6000)
    radius, height = FORM.at(t).T
    t, radius, height = (a[: np.argmax(height)] for a in (t, radius, height))
    first = np.searchsorted(height[200:], FIRST_ROW) + 200
    pitch = 2 * np.pi / AROUND * radius * ROW_PITCH
    number = np.r_[0, np.cumsum(np.diff(t) / (0.5 * (pitch[1:] + pitch[:-1])))]
    return PchipInterpolator(t, number - number[first])


ROW_OF = _rows()


def row_number(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the row number, a fraction between rows, at outline parameters (n,)."""
    inside_neck = t > ROW_OF.x[-1]
    number = ROW_OF(np.minimum(t, ROW_OF.x[-1]))
    return np.clip(np.where(inside_neck, ROW_COUNT + 2, number), -2, ROW_COUNT + 2)


def studs(p: Points, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the heights of the bumps and (negative) of the dimples at points, mm.

    ``t`` are the outline's parameters nearest to the points, (n,).
    """
    number = row_number(t)
    turn = np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi) * AROUND
    pitch = 2 * np.pi / AROUND * FORM.at(t)[:, 0]
    bumps, dimples = np.zeros(len(p)), np.zeros(len(p))
    for row in (np.floor(number), np.floor(number) + 1):
        across = turn - (0.5 + TWIST) * row
        across -= np.round(across)
        away = np.hypot(across, (number - row) * ROW_PITCH) / REACH
        height = HEIGHT * pitch * bump(away, 2.0) * ((row >= 0) & (row < ROW_COUNT))
        odd = row % 2 == 1
        bumps += np.where(odd, 0.0, height)
        dimples -= np.where(odd, 0.8 * height, 0.0)
    return bumps, dimples


def form(p: Points) -> NDArray[np.float64]:
    """Return the implicit form of the whole vase."""
    nearest = FORM.nearest(p)
    return FORM.distance(p, nearest) - sum(studs(p, nearest))


def make() -> Sample:
    """Return the vase."""
    vertices, faces = mesh_form(
        form, np.array([-66.0, -66.0, -3.0]), np.array([66.0, 66.0, 229.0]), 1.6, EDGE
    )
    plain = project(FORM.distance, vertices)
    bumps, dimples = studs(vertices, FORM.nearest(vertices))
    height = vertices[:, 2]
    front = (vertices[:, 0] > 20) & (height > 44) & (height < 140)
    return Sample(vertices, faces, plain, {"bumps": bumps, "dimples": dimples}, front)
