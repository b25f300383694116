"""The hand drill of Fig. 14: its handle has finger grooves, and the grooves carry small bumps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from resources.generators.remesh import Points, heights, mesh_form, project
from resources.generators.sample import Sample
from resources.generators.solids import box, bump, fade, smooth_union, turned

Values = NDArray[np.float64]

EDGE, HANDLE_EDGE = 1.65, 1.15
TOP, FOOT = np.array([-20.0, 0.0, -12.0]), np.array([-44.0, 0.0, -154.0])
DOWN = (FOOT - TOP) / np.linalg.norm(FOOT - TOP)
FORWARD = np.array([-DOWN[2], 0.0, DOWN[0]])
DEPTH, WIDTH = 24.0, 18.0  # half axes of the handle's section, mm
FIRST, PITCH = 58.5, 19.0  # first finger groove below TOP, and their distance, mm
GROOVE, BUMP, BUMP_RADIUS, SPACING = 4.6, 1.05, 2.75, 6.4


def _grip(p: Points) -> tuple[Values, Values, Values]:
    """Return coordinates of the handle: down its axis, forward, and sideways."""
    off = p - TOP
    return off @ DOWN, off @ FORWARD, p[:, 1]


def handle(p: Points) -> Values:
    """Return the distance to the handle without grooves: an ellipse swept, with a palm swell."""
    down, forward, side = _grip(p)
    length = np.linalg.norm(FOOT - TOP)
    swell = 1.0 + 0.10 * np.exp(-(((down - 82) / 36) ** 2))
    depth, width = DEPTH * np.where(forward < 0, swell, 1.0), WIDTH * swell
    first = np.hypot(forward / depth, side / width)
    second = np.hypot(forward / depth**2, side / width**2)
    tube = first * (first - 1) / np.maximum(second, 1e-6)
    return np.maximum(tube, np.abs(down - 0.5 * length) - 0.5 * length)


def barrel(p: Points) -> Values:
    """Return the distance to the motor and gear housing, clutch ring, chuck and bit."""
    x = p[:, 0]
    across = np.hypot(p[:, 1], p[:, 2])
    # The section is squarish behind and becomes round towards the chuck.
    m = 2.0 + 0.7 * fade(x, 74.0, 0.0)
    square = (np.abs(p[:, 1]) ** m + np.abs(p[:, 2]) ** m) ** (1 / m)
    angle = np.arctan2(p[:, 1], p[:, 2])
    motor = turned(x, square, -88.0, 46.0, 28.5, 30.5, 14.0)
    gear = turned(x, square, 24.0, 76.0, 33.0, 25.5, 2.6)
    shell = smooth_union(motor, gear, 1.2)
    ring = turned(x, across - 0.55 * np.cos(24 * angle), 79.0, 93.0, 25.2, 24.2, 2.2)
    sleeve = turned(x, across - 0.5 * np.cos(16 * angle), 96.0, 130.0, 21.5, 20.5, 2.2)
    nose = turned(x, across, 126.0, 150.0, 21.0, 10.0, 1.8)
    core = turned(x, across, 60.0, 126.0, 23.0, 17.5, 2.0)
    bit = turned(x, across, 130.0, 186.0, 3.4, 3.4, 1.6)
    front = smooth_union(smooth_union(ring, sleeve, 0.8), smooth_union(nose, bit, 1.2), 1.2)
    return smooth_union(smooth_union(shell, core, 1.6), front, 1.4)


def battery(p: Points) -> Values:
    """Return the distance to the battery foot with the seam around it."""
    shoe = box(p, (-31.0, 0.0, -162.0), (47.0, 32.0, 13.0), 9.0)
    pack = box(p, (-29.0, 0.0, -180.0), (50.0, 35.0, 16.0), 8.0)
    return smooth_union(shoe, pack, 1.2)


def trigger(p: Points) -> Values:
    """Return the distance to the trigger."""
    down, forward, side = _grip(p)
    q = np.column_stack([forward - 23.0 + 0.012 * (down - 31.0) ** 2, side, down - 31.0])
    return box(q, (0.0, 0.0, 0.0), (8.0, 8.0, 12.0), 4.5)


def plain(p: Points) -> Values:
    """Return the distance to the drill without finger grooves, bumps and vents."""
    stand = smooth_union(handle(p), battery(p), 9.0)
    whole = smooth_union(barrel(p), stand, 11.0)
    return smooth_union(whole, trigger(p), 1.6)


def _gripped(p: Points) -> Values:
    """Return 1 on the front of the handle, 0 on its back and on all else, smooth between."""
    down, forward, _ = _grip(p)
    ends = fade(down, FIRST - 14.0, FIRST - 9.0) * fade(down, FIRST + 71.0, FIRST + 66.0)
    return ends * fade(forward / DEPTH, -0.25, 0.75) * fade(handle(p), 9.0, 5.0)


def finger_grooves(p: Points) -> Values:
    """Return the (negative) height of the finger grooves, mm."""
    down = _grip(p)[0]
    phase = np.clip((down - FIRST) / PITCH, -0.5, 3.5)
    wave = (0.5 + 0.5 * np.cos(2 * np.pi * phase)) ** 1.2
    return -GROOVE * wave * _gripped(p)


def bumps(p: Points) -> Values:
    """Return the height of the small bumps in the finger grooves, mm."""
    down, forward, side = _grip(p)
    arc = np.arctan2(side / WIDTH, forward / DEPTH) * 0.5 * (DEPTH + WIDTH)
    finger = np.clip(np.round((down - FIRST) / PITCH), 0, 3)
    along = down - FIRST - PITCH * finger
    row = np.clip(np.round(along / SPACING), -1, 1)
    shift = 0.5 * SPACING * (row != 0)
    column = shift + SPACING * np.round((arc - shift) / SPACING)
    away = np.hypot(along - SPACING * row, arc - column) / BUMP_RADIUS
    return BUMP * bump(away) * (np.abs(column) < 3.2 * SPACING) * _gripped(p) ** 0.25


def vents(p: Points) -> Values:
    """Return the (negative) height of the slanted cooling slots behind the motor, mm."""
    x = p[:, 0] + 0.35 * p[:, 2]
    slot = np.clip(np.round((x + 62.0) / 9.0), -1, 2)
    away = np.abs(x + 62.0 - 9.0 * slot) * 0.94
    sides = fade(np.abs(p[:, 2]), 17.0, 12.0) * fade(np.abs(p[:, 1]), 12.0, 18.0)
    return -2.2 * (1 - fade(away, 0.9, 3.1)) * sides


def form(p: Points) -> Values:
    """Return the implicit form of the whole drill."""
    return plain(p) - finger_grooves(p) - bumps(p) - vents(p)


def on_handle(p: Points) -> NDArray[np.bool_]:
    """Return which points lie on the part of the handle that the fingers hold, (n,)."""
    down, forward, _ = _grip(p)
    return (down > 46) & (down < 128) & (np.abs(forward) < 34)


def make() -> Sample:
    """Return the drill."""
    lower, upper = np.array([-92.0, -38.0, -199.0]), np.array([190.0, 38.0, 36.0])
    vertices, faces = mesh_form(form, lower, upper, 1.1, EDGE, fine=(on_handle, HANDLE_EDGE))
    foot = project(plain, vertices, 16)
    bump_height, vent_height = bumps(vertices), vents(vertices)
    parts = {
        "grooves": heights(plain, vertices, foot) - bump_height - vent_height,
        "bumps": bump_height,
        "vents": vent_height,
    }
    front = on_handle(vertices) & (_grip(vertices)[1] > -8)
    return Sample(vertices, faces, foot, parts, front)
