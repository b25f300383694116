"""The wavy plate of Figs. 5, 6 and 11: an arched plate with waves, and pearls in their troughs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from resources.generators.remesh import Faces, Points, remesh
from resources.generators.sample import Sample
from resources.generators.solids import bump, fade

LENGTH, WIDTH = 300.0, 200.0
FRAME = 26.0  # plain border, mm
SAG = 14.0
WAVELENGTH = 248.0 / 7
WAVE = 4.6
EDGE = 2.0

Values = NDArray[np.float64]


def arch(x: Values, y: Values) -> Values:
    """Return the height of the plain plate."""
    return SAG * (1 - (2 * x / LENGTH) ** 2) + 0.25 * SAG * (1 - (2 * y / WIDTH) ** 2)


def window(x: Values, y: Values) -> Values:
    """Return 1 on the interior and 0 on the frame."""
    inset = np.minimum(LENGTH / 2 - np.abs(x), WIDTH / 2 - np.abs(y))
    return fade(inset, FRAME, FRAME + 22.0)


def waves(x: Values, y: Values) -> Values:
    """Return the height of the long waves."""
    return WAVE * np.cos(2 * np.pi * x / WAVELENGTH) * window(x, y)


def pearls(x: Values, y: Values) -> Values:
    """Return the height of the pearls; they shrink from trough to trough, left to right."""
    height = np.zeros_like(x)
    troughs = (np.arange(-3, 3) + 0.5) * WAVELENGTH
    radii = np.array([9.0, 7.8, 6.8, 5.9, 5.1, 4.4])
    for trough, radius in zip(troughs, radii, strict=True):
        pitch = 2.25 * radius
        nearest = pitch * np.round(y / pitch)
        inside = np.abs(nearest) < WIDTH / 2 - FRAME - 12.0
        height += inside * 0.55 * radius * bump(np.hypot(x - trough, y - nearest) / radius)
    return height


def make() -> Sample:
    """Return the plate."""
    vertices, faces = _sheet()
    x, y = vertices[:, 0], vertices[:, 1]
    wave, pearl = waves(x, y), pearls(x, y)
    plain = np.column_stack([x, y, arch(x, y)])
    return Sample(
        vertices=plain + np.column_stack([0 * x, 0 * x, wave + pearl]),
        faces=faces,
        plain=plain,
        parts={"waves": wave, "pearls": pearl},
        region=window(x, y) > 0,
    )


def _sheet() -> tuple[Points, Faces]:
    """Return an irregular triangulation of the finished plate, its outline exactly rectangular."""
    columns, rows = int(LENGTH) + 1, int(WIDTH) + 1
    x, y = (
        g.ravel()
        for g in np.meshgrid(
            np.linspace(-LENGTH / 2, LENGTH / 2, columns),
            np.linspace(-WIDTH / 2, WIDTH / 2, rows),
        )
    )
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    faces = np.concatenate(
        [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)]
    )
    vertices = np.column_stack([x, y, arch(x, y) + waves(x, y) + pearls(x, y)])
    return remesh(vertices, faces, EDGE, crease=60.0)
