"""Bumpy sheets with irregular triangles and a region of a given size."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial import Delaunay

from engine import Mesh
from engine.arrays import I64


@cache
def sheet(m: int, seed: int = 0) -> tuple[Mesh, I64]:
    """Return a mesh in millimetres and the ids of a round region of `m` vertices on it."""
    side = int(np.ceil(np.sqrt(m * 4 / np.pi))) + 8
    at = (np.arange(side) + 0.5) / side
    u, v = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    shift = np.random.default_rng(seed).uniform(-0.35, 0.35, (2, side * side)) / side
    p = np.column_stack([u, v]) + shift.T
    faces = Delaunay(p).simplices.astype(np.int64)
    a, b, c = (p[faces[:, i]] for i in range(3))
    turned = np.cross(b - a, c - a) < 0
    faces[turned] = faces[turned][:, ::-1]
    x, y = p.T
    height = (
        0.15 * np.cos(2.5 * (x - 0.5)) * np.cos(2.0 * (y - 0.5))
        + 0.012 * np.sin(31 * x) * np.sin(27 * y)
        + 0.003 * np.sin(95 * x + 1) * np.sin(88 * y)
    )
    mesh = Mesh(100 * np.column_stack([p, height]), faces)
    distance = np.linalg.norm(p - 0.5, axis=1)
    return mesh, np.sort(np.argsort(distance, kind="stable")[:m])
