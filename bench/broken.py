"""Meshes that are broken on purpose, each in one named way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine import Mesh
from engine.arrays import F64, I64


def grid(side: int, seed: int = 0, jitter: float = 0.25) -> tuple[F64, I64]:
    """Return vertices and faces of a bumpy square sheet of side x side vertices, unit size."""
    rng = np.random.default_rng(seed)
    at = np.linspace(0, 1, side)
    u, v = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    inner = (u > 0) & (u < 1) & (v > 0) & (v < 1)
    shift = rng.uniform(-jitter, jitter, (2, side * side)) / side * inner
    u, v = u + shift[0], v + shift[1]
    height = 0.05 * np.sin(9 * u) * np.sin(7 * v) + 0.01 * np.sin(40 * u) * np.cos(37 * v)
    ids = np.arange(side * side).reshape(side, side)
    a, b, c, d = ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return np.column_stack([u, v, height]), faces


def slivers(seed: int) -> Mesh:
    """A sheet squeezed a thousandfold in one direction in its middle: caps and slivers."""
    x, f = grid(40, seed)
    x[:, 0] = np.sign(x[:, 0] - 0.5) * np.abs(2 * x[:, 0] - 1) ** 6 / 2 + 0.5
    return Mesh(x, f)


def needles(seed: int) -> Mesh:
    """A sheet with some vertices moved almost onto a neighbour."""
    x, f = grid(40, seed)
    rng = np.random.default_rng(seed)
    pick = rng.choice(len(f), 60, replace=False)
    x[f[pick, 0]] = x[f[pick, 1]] + 1e-7 * rng.standard_normal((60, 3))
    return Mesh(x, f)


def coincident(seed: int) -> Mesh:
    """A sheet with some vertices exactly on a neighbour: faces without area."""
    x, f = grid(40, seed)
    pick = np.random.default_rng(seed).choice(len(f), 40, replace=False)
    x[f[pick, 0]] = x[f[pick, 1]]
    return Mesh(x, f)


def collinear(seed: int) -> Mesh:
    """A sheet with vertices split into edges, which leaves zero-area faces with three corners."""
    x, f = grid(40, seed)
    pick = np.random.default_rng(seed).choice(len(f), 50, replace=False)
    middle = (x[f[pick, 0]] + x[f[pick, 1]]) / 2
    extra = np.column_stack([f[pick, 0], f[pick, 1], len(x) + np.arange(50)])
    return Mesh(np.concatenate([x, middle]), np.concatenate([f, extra]))


def fins(seed: int) -> Mesh:
    """A sheet with triangles standing on some of its edges: three faces on an edge."""
    x, f = grid(40, seed)
    pick = np.random.default_rng(seed).choice(len(f), 40, replace=False)
    tips = x[f[pick, 0]] + np.array([0, 0, 0.05])
    extra = np.column_stack([f[pick, 0], f[pick, 1], len(x) + np.arange(40)])
    return Mesh(np.concatenate([x, tips]), np.concatenate([f, extra]))


def pinched(seed: int) -> Mesh:
    """Two sheets that share single vertices."""
    x, f = grid(30, seed)
    n = len(x)
    other = f + n
    for i in np.random.default_rng(seed).choice(n, 12, replace=False):
        other[other == i + n] = i
    return Mesh(np.concatenate([x, x + np.array([0, 0, 0.1])]), np.concatenate([f, other]))


def holes(seed: int) -> Mesh:
    """A sheet with a fifth of its faces missing."""
    x, f = grid(40, seed)
    return Mesh(x, f[np.random.default_rng(seed).random(len(f)) > 0.2])


def folded(seed: int) -> Mesh:
    """A sheet with faces turned over and repeated corners."""
    x, f = grid(40, seed)
    rng = np.random.default_rng(seed)
    turned = rng.random(len(f)) < 0.3
    f[turned] = f[turned][:, ::-1]
    f[rng.choice(len(f), 20, replace=False), 2] = f[0, 0]
    same = rng.choice(len(f), 20, replace=False)
    f[same, 1] = f[same, 0]
    return Mesh(x, f)


def spikes(seed: int) -> Mesh:
    """A sheet with single vertices far out."""
    x, f = grid(40, seed)
    rng = np.random.default_rng(seed)
    x[rng.choice(len(x), 15, replace=False)] += 3 * rng.standard_normal((15, 3))
    return Mesh(x, f)


def noise(seed: int) -> Mesh:
    """A sheet whose vertices are shaken by more than an edge length."""
    x, f = grid(40, seed)
    return Mesh(x + 0.06 * np.random.default_rng(seed).standard_normal(x.shape), f)


def far_and_small(seed: int) -> Mesh:
    """A sheet of size 1e-3, a kilometre from the origin."""
    x, f = grid(40, seed)
    return Mesh(1e-3 * x + [1e3, -1e3, 1e3], f)


def dust(seed: int) -> Mesh:
    """A sheet, lonely vertices, single triangles and tiny tetrahedra."""
    x, f = grid(40, seed)
    rng = np.random.default_rng(seed)
    n = len(x)
    more = rng.random((220, 3))
    tri = n + 100 + np.arange(60).reshape(-1, 3)
    tet = (
        n
        + 160
        + 4 * np.arange(15)[:, None, None]
        + np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    )
    return Mesh(np.concatenate([x, more]), np.concatenate([f, tri, tet.reshape(-1, 3)]))


def soup(seed: int) -> Mesh:
    """Triangles between vertices drawn at random."""
    rng = np.random.default_rng(seed)
    return Mesh(rng.random((200, 3)), rng.integers(0, 200, (600, 3)))


def doubled(seed: int) -> Mesh:
    """A sheet with every face there twice, once turned over."""
    x, f = grid(40, seed)
    return Mesh(x, np.concatenate([f, f[:, ::-1]]))


KINDS: dict[str, Callable[[int], Mesh]] = {
    make.__name__: make
    for make in (
        slivers, needles, coincident, collinear, fins, pinched, holes, folded, spikes, noise,
        far_and_small, dust, soup, doubled,
    )
}  # fmt: skip
