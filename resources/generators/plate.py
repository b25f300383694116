"""The wavy plate of Figs. 5, 6 and 11: an arched plate with waves.

Three scales of detail: a broad swell, waves on it, and pearls in their troughs that shrink from
left to right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from resources.generators.remesh import Faces, Points, relax, remesh
from resources.generators.sample import Sample
from resources.generators.solids import bump, fade

LENGTH, WIDTH = 300.0, 200.0
FRAME = 26.0  # plain border, mm
SAG = 18.0
WAVELENGTH = 248.0 / 7
WAVE = 5.5
SWELL = 3.0
EDGE = 2.0

Values = NDArray[np.float64]


def arch(x: Values, y: Values) -> Values:
    """Return the height of the plain plate."""
    return SAG * (1 - (2 * x / LENGTH) ** 2) + 0.25 * SAG * (1 - (2 * y / WIDTH) ** 2)


def window(x: Values, y: Values) -> Values:
    """Return 1 on the interior and 0 on the frame."""
    ends = fade(LENGTH / 2 - np.abs(x), FRAME, FRAME + 20.0)
    return ends * fade(WIDTH / 2 - np.abs(y), FRAME, FRAME + 44.0)


def meander(y: Values) -> Values:
    """Return how far the crests bend sideways along their course, mm."""
    return 6.0 * np.sin(2 * np.pi * np.asarray(y) / 180.0)


def waves(x: Values, y: Values) -> Values:
    """Return the height of the long waves."""
    return WAVE * np.cos(2 * np.pi * (x - meander(y)) / WAVELENGTH) * window(x, y)


def swell(x: Values, y: Values) -> Values:
    """Return the height of the broad swell that the waves ride on."""
    return SWELL * np.cos(2 * np.pi * 3 / 7 * (x - meander(y)) / WAVELENGTH) * window(x, y)


def pearls(x: Values, y: Values) -> Values:
    """Return the height of the pearls; they shrink from trough to trough, left to right."""
    height = np.zeros_like(x)
    troughs = (np.arange(-3, 3) + 0.5) * WAVELENGTH
    radii = np.array([8.0, 7.2, 6.4, 5.6, 4.9, 4.2])
    for trough, radius in zip(troughs, radii, strict=True):
        pitch = 2.3 * radius
        nearest = pitch * np.round(y / pitch)
        inside = np.abs(nearest) < WIDTH / 2 - FRAME - 24.0
        height += (
            inside
            * 0.5
            * radius
            * bump(np.hypot(x - trough - meander(nearest), y - nearest) / radius)
        )
    return height


def height(x: Values, y: Values) -> Values:
    """Return the height of the finished plate."""
    return arch(x, y) + swell(x, y) + waves(x, y) + pearls(x, y)


def make() -> Sample:
    """Return the plate."""
    vertices, faces = _sheet()
    x, y = vertices[:, 0], vertices[:, 1]
    parts = {"swell": swell(x, y), "waves": waves(x, y), "pearls": pearls(x, y)}
    plain = np.column_stack([x, y, arch(x, y)])
    return Sample(
        vertices=plain + np.column_stack([0 * x, 0 * x, sum(parts.values())]),
        faces=faces,
        plain=plain,
        parts=parts,
        region=window(x, y) > 0,
    )


def _sheet() -> tuple[Points, Faces]:
    """Return an irregular triangulation of the finished plate, its outline exactly rectangular."""
    flat = _scatter()
    faces = Delaunay(flat).simplices.astype(np.int64)
    u, v = (flat[faces[:, k]] - flat[faces[:, 0]] for k in (1, 2))
    up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0
    faces = np.where(up[:, None], faces, faces[:, ::-1])
    vertices, faces = remesh(np.column_stack([flat, height(*flat.T)]), faces, EDGE, crease=60.0)
    inset = np.array([LENGTH, WIDTH]) / 2 - np.abs(vertices[:, :2])
    snapped = np.copysign(np.array([LENGTH, WIDTH]) / 2, vertices[:, :2])
    vertices[:, :2] = np.where(inset < 1e-3, snapped, vertices[:, :2])
    held = (inset < 1e-3).any(axis=1)
    return relax(lambda p: p[:, 2] - height(p[:, 0], p[:, 1]), vertices, faces, held=held), faces


def _scatter() -> Points:
    """Return points in the rectangle with no rows or columns, even along its outline."""
    half = np.array([LENGTH, WIDTH]) / 2
    columns, rows = int(LENGTH) + 1, int(WIDTH) + 1
    x, y = np.meshgrid(
        np.linspace(-half[0], half[0], columns), np.linspace(-half[1], half[1], rows)
    )
    points = np.column_stack([x.ravel(), y.ravel()])
    inside = (np.abs(points) < half - 1e-9).all(axis=1)
    points[inside] += np.random.default_rng(5).uniform(-0.4, 0.4, (inside.sum(), 2))
    return points
