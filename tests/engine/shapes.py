"""Small meshes with a known form, cameras, and strokes, for the tests of editing."""

from __future__ import annotations

import numpy as np

from engine import Mesh, View
from engine.arrays import F64, I64


def grid_faces(rows: int, columns: int, closed: bool = False) -> I64:
    """Faces of a grid of vertices, row by row; `closed` joins the last column to the first."""
    i, j = np.meshgrid(
        np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij"
    )
    a = (i * columns + j).ravel()
    b = ((i + 1) * columns + j).ravel()
    c = ((i + 1) * columns + (j + 1) % columns).ravel()
    d = (i * columns + (j + 1) % columns).ravel()
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def plate(n: int, wave: float = 0.0, jitter: float = 0.2, waves: float = 6.0) -> Mesh:
    """Square plate of side 1 with n by n vertices, irregular triangles, and waves on it."""
    u, v = (a.ravel() / (n - 1.0) for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    shift = np.random.default_rng(7).uniform(-jitter, jitter, (n * n, 2)) / (n - 1)
    border = (u == 0) | (u == 1) | (v == 0) | (v == 1)
    shift[border] = 0
    u, v = u + shift[:, 0], v + shift[:, 1]
    height = wave * np.sin(waves * np.pi * u) * np.sin(waves * np.pi * v)
    return Mesh(np.column_stack([u, v, height]), grid_faces(n, n))


def tube(rings: int, around: int, radius: float = 0.2, length: float = 2.0) -> Mesh:
    """Open tube along z."""
    z, t = np.meshgrid(
        np.linspace(0, length, rings), np.arange(around) * 2 * np.pi / around, indexing="ij"
    )
    x = np.column_stack([radius * np.cos(t).ravel(), radius * np.sin(t).ravel(), z.ravel()])
    return Mesh(x, grid_faces(rings, around, closed=True)[:, ::-1])


def sphere(subdivisions: int = 4) -> Mesh:
    """Unit sphere from an octahedron."""
    x = np.vstack([np.eye(3), -np.eye(3)])
    upper = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]])
    f = np.vstack([upper, np.where(upper == 2, 5, upper)[:, ::-1]])
    for _ in range(subdivisions):
        corners = np.sort(f[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, which = np.unique(corners, axis=0, return_inverse=True)
        middle = len(x) + which.reshape(-1, 3)
        x = np.vstack([x, x[edges].mean(axis=1)])
        a, b, c = f.T
        ab, bc, ca = middle.T
        f = np.vstack([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]).reshape(4, 3, -1)
        f = f.transpose(0, 2, 1).reshape(-1, 3)
    return Mesh(x / np.linalg.norm(x, axis=1, keepdims=True), f)


def camera(
    eye: tuple[float, float, float],
    focus: tuple[float, float, float] = (0.0, 0.0, 0.0),
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
    size: tuple[float, float] = (1000.0, 800.0),
    angle: float = 30.0,
) -> View:
    """Perspective camera."""
    at = np.asarray(eye, dtype=float)
    forward = np.asarray(focus, dtype=float) - at
    far = float(np.linalg.norm(forward))
    forward = forward / far
    side = np.cross(forward, up)
    side /= np.linalg.norm(side)
    world = np.eye(4)
    world[:3, :3] = side, np.cross(side, forward), -forward
    world[:3, 3] = -world[:3, :3] @ at
    t = 1 / np.tan(np.radians(angle) / 2)
    lens = np.array(
        [[t * size[1] / size[0], 0, 0, 0], [0, t, 0, 0], [0, 0, -1.02, -0.2 * far], [0, 0, -1, 0]]
    )
    return View(lens @ world, size)


def parallel(
    direction: int = 2, size: tuple[float, float] = (1000.0, 800.0), scale: float = 1.0
) -> View:
    """Parallel projection along an axis, `scale` mesh units to half the height."""
    order = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][direction]
    matrix = np.zeros((4, 4))
    matrix[[0, 1, 2], order] = size[1] / size[0] / scale, 1 / scale, -0.1
    matrix[3, 3] = 1
    return View(matrix, size)


def faces_along(mesh: Mesh, view: View, path: F64) -> I64:
    """Faces that a stroke passes over, in its order, where the surface does not hide itself."""
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0, s[-1], int(s[-1] * 2) + 2)
    points = np.column_stack([np.interp(at, s, column) for column in path.T])
    clip = np.column_stack([mesh.vertices, np.ones(mesh.n)]) @ view.matrix.T
    depth = clip[:, 2] / clip[:, 3]
    corners = view.project(mesh.vertices)[mesh.faces]
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area[area == 0] = np.inf
    found = []
    for point in points:
        d = point - a
        p = (d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0]) / area
        q = (u[:, 0] * d[:, 1] - u[:, 1] * d[:, 0]) / area
        hit = np.flatnonzero((p >= 0) & (q >= 0) & (p + q <= 1))
        if len(hit):
            found.append(hit[np.argmin(depth[mesh.faces[hit]].mean(axis=1))])
    return np.array(found, dtype=np.int64)


def inner(mesh: Mesh, low: float, high: float, axis: int = 0) -> I64:
    """Vertices whose coordinate lies strictly between two values and off the open borders."""
    x = mesh.vertices[:, axis]
    return np.flatnonzero((x > low) & (x < high) & ~mesh.topology.border_vertices)
