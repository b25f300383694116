"""The fuel tank of Fig. 13: a sculpted body with a filler cap on top and grooves on its sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from resources.generators.remesh import Points, gradient, heights, mesh_form, project
from resources.generators.sample import Sample
from resources.generators.solids import fade, smooth_cut, smooth_union, turned

Values = NDArray[np.float64]

HALF_LENGTH = 200.0
EDGE, FEATURE_EDGE = 2.5, 1.75
# Stations along the body from rear (-1) to front (1), continued past both ends.
STATIONS = np.array([-1.2, -0.8, -0.4, 0.0, 0.35, 0.7, 1.2])
HALF_WIDTH = CubicSpline(STATIONS, [62.0, 70.0, 82.0, 99.0, 111.0, 110.0, 88.0])
TOP = CubicSpline(STATIONS, [84.0, 98.0, 120.0, 147.0, 162.0, 160.0, 132.0])
BOTTOM = CubicSpline(STATIONS, [10.0, 4.0, 0.0, 0.0, 2.0, 8.0, 22.0])

CAP_X = 62.0
GROOVES = ((98.0, 76.0), (77.0, 62.0), (56.0, 48.0))  # heights at the front and at the rear


def _loft(p: Points) -> Values:
    """Return the implicit function of the lofted body, 0 on it, of degree one."""
    along = np.clip(p[:, 0] / HALF_LENGTH, -1.2, 1.2)
    top, bottom = TOP(along), BOTTOM(along)
    across = np.abs(p[:, 1]) / HALF_WIDTH(along)
    rise = (p[:, 2] - 0.5 * (top + bottom)) / (0.5 * (top - bottom))
    # Rounder above than below: the exponent of the section changes softly with height.
    m = 2.9 - 0.5 * np.tanh(2 * rise)
    section = (across**m + np.abs(rise) ** m) ** (1 / m)
    # Blunter behind than in front.
    n = 2.9 - 0.4 * np.tanh(3 * along)
    return (np.abs(p[:, 0] / HALF_LENGTH) ** n + section**n) ** (1 / n) - 1


def body(p: Points) -> Values:
    """Return about the distance to the plain body, with knee hollows and the frame's tunnel."""
    slope = np.linalg.norm(gradient(_loft, p), axis=1)
    distance = _loft(p) / np.maximum(slope, 1e-3)
    knee = np.exp(-(((p[:, 0] + 75) / 80) ** 2) - ((p[:, 2] - 30) / 42) ** 2)
    distance = distance + 15.0 * knee * fade(np.abs(p[:, 1]), 20.0, 60.0)
    tunnel = np.hypot(p[:, 1], p[:, 2] + 16) - 44
    return smooth_cut(distance, tunnel, 12.0)


def grooves(p: Points) -> Values:
    """Return the (negative) height of the side grooves, mm."""
    x, z = p[:, 0], p[:, 2]
    t = (x + 165) / 320
    depth = np.zeros(len(p))
    for number, (front, rear) in enumerate(GROOVES):
        centre = rear + (front - rear) * t + 9 * np.sin(np.pi * np.clip(t, 0, 1))
        lean = (front - rear) / 320 + 9 * np.pi / 320 * np.cos(np.pi * np.clip(t, 0, 1))
        away = np.abs(z - centre) / np.hypot(1, lean)
        wide = 7.5 + 3.0 * np.clip(t, 0, 1)
        ends = fade(x, -150 + 22 * number, -105 + 22 * number) * fade(x, 160, 125)
        depth += 3.4 * ends * (1 - fade(away / wide, 0.05, 1.0))
    return -depth * fade(np.abs(p[:, 1]), 15.0, 30.0)


def _cap_frame() -> tuple[Points, Points]:
    seat = project(body, np.array([[CAP_X, 0.0, 160.0]]))
    up = gradient(body, seat)[0]
    return seat[0], up / np.linalg.norm(up)


SEAT, UP = _cap_frame()


def cap(p: Points) -> Values:
    """Return the distance to the filler cap: a flange, and a fluted dome on it."""
    off = p - SEAT
    rise = off @ UP
    flat = off - rise[:, None] * UP
    across = np.linalg.norm(flat, axis=1)
    angle = np.arctan2(flat[:, 1], flat[:, 0])
    flange = turned(rise, across, -12.0, 4.4, 38.0, 34.5, 2.4)
    fluted = across - 1.1 * np.cos(12 * angle) * fade(across, 10.0, 22.0)
    dome = turned(rise + 0.003 * across**2, fluted, -10.0, 16.5, 27.0, 25.0, 3.6)
    return smooth_union(flange, dome, 2.0)


def form(p: Points) -> Values:
    """Return the implicit form of the whole tank."""
    return smooth_union(body(p) - grooves(p), cap(p), 2.5)


def _fine(p: Points) -> NDArray[np.bool_]:
    """Return which points need the shorter edges: grooves and cap, (n,)."""
    return (grooves(p) < -0.05) | (np.linalg.norm(p - SEAT, axis=1) < 44)


def make() -> Sample:
    """Return the tank."""
    lower, upper = np.array([-206.0, -118.0, -8.0]), np.array([206.0, 118.0, 192.0])
    vertices, faces = mesh_form(form, lower, upper, 2.0, EDGE, fine=(_fine, FEATURE_EDGE))
    plain = project(body, vertices, steps=16)
    height = heights(body, vertices, plain)
    parts = {"grooves": np.minimum(height, 0.0), "cap": np.maximum(height, 0.0)}
    x, z = vertices[:, 0], vertices[:, 2]
    side = (vertices[:, 1] < -25) & (x > -170) & (x < 175) & (z > 28) & (z < 132)
    return Sample(vertices, faces, plain, parts, side)
