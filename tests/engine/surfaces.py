"""Meshes and regions with known answers, for the tests of operators, base shape and modes."""

from __future__ import annotations

from pathlib import Path

import igl
import numpy as np
from scipy.spatial import Delaunay, cKDTree

from engine import Mesh
from engine.arrays import F64, I64
from tests.comma_locale import plain_numbers


def icosphere_like(n: int, radius: float = 1.0, jitter: float = 0.3, seed: int = 0) -> Mesh:
    """Sphere of `n` points in a spiral, shaken, with the triangles of their convex hull."""
    from scipy.spatial import ConvexHull

    i = np.arange(n) + 0.5
    polar, turn = np.arccos(1 - 2 * i / n), np.pi * (1 + 5**0.5) * i
    x = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    x += jitter * np.sqrt(4 * np.pi / n) / 2 * np.random.default_rng(seed).uniform(-1, 1, (n, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    f = ConvexHull(x).simplices.astype(np.int64)
    a, b, c = (x[f[:, i]] for i in range(3))
    outward = np.einsum("fi,fi->f", np.cross(b - a, c - a), a)
    f[outward < 0] = f[outward < 0][:, ::-1]
    return Mesh(radius * x, f)


def flat(n: int, shape: str = "square", jitter: float = 0.25, seed: int = 1) -> Mesh:
    """Unit square or unit disc in the plane z = 0 with about n irregular vertices."""
    rng = np.random.default_rng(seed)
    if shape == "square":
        side = int(np.sqrt(n))
        g = np.linspace(0, 1, side)
        u, v = (a.ravel() for a in np.meshgrid(g, g, indexing="ij"))
        inner = (u > 0) & (u < 1) & (v > 0) & (v < 1)
        p = (
            np.column_stack([u, v])
            + inner[:, None] * rng.uniform(-jitter, jitter, (len(u), 2)) / side
        )
    else:
        rings = int(np.sqrt(n / np.pi))
        parts = [np.zeros((1, 2))]
        for r in range(1, rings + 1):
            turn = 2 * np.pi * (np.arange(6 * r) / (6 * r)) + rng.uniform(0, 1)
            shaken = r / rings + (r < rings) * rng.uniform(-jitter, jitter, 6 * r) / rings
            parts.append(shaken[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]))
        p = np.concatenate(parts)
    f = Delaunay(p).simplices.astype(np.int64)
    a, b, c = (p[f[:, i]] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    f = f[np.abs(area) > 1e-9]
    area = area[np.abs(area) > 1e-9]
    f[area < 0] = f[area < 0][:, ::-1]
    return Mesh(np.column_stack([p, np.zeros(len(p))]), f)


def interior(mesh: Mesh) -> I64:
    """All vertices that are not on an open border."""
    return np.flatnonzero(~mesh.topology.border_vertices)


def lifted(mesh: Mesh, height: F64) -> Mesh:
    """The mesh with z raised by `height` (n,)."""
    return mesh.with_vertices(mesh.vertices + np.outer(height, [0.0, 0.0, 1.0]))


def ball(mesh: Mesh, size: int, centre: int | None = None) -> I64:
    """The `size` vertices nearest to one, ascending."""
    at = mesh.vertices[mesh.n // 3 if centre is None else centre]
    _, ids = cKDTree(mesh.vertices).query(at, k=size)
    return np.sort(np.atleast_1d(ids)).astype(np.int64)


def real(folder: Path, name: str) -> Mesh:
    """A mesh of the shared folder's clean ones."""
    with plain_numbers():
        v, f = igl.read_triangle_mesh(str(folder / "clean" / name))
    return Mesh(v, f.astype(np.int64))


def dihedrals(mesh: Mesh, ids: I64) -> F64:
    """Angles between neighbouring faces over the edges that touch the vertices `ids`, radians."""
    f = mesh.faces
    corners = np.sort(f[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    key = corners[:, 0] * mesh.n + corners[:, 1]
    order = np.argsort(key, kind="stable")
    face = np.repeat(np.arange(len(f)), 3)[order]
    key = key[order]
    pair = np.flatnonzero(key[1:] == key[:-1])
    ends = np.column_stack([key[pair] // mesh.n, key[pair] % mesh.n])
    near = np.isin(ends, ids).any(axis=1)
    normal = mesh.face_normals / np.linalg.norm(mesh.face_normals, axis=1, keepdims=True)
    dots = np.einsum("ei,ei->e", normal[face[pair[near]]], normal[face[pair[near] + 1]])
    return np.arccos(np.clip(dots, -1, 1))
