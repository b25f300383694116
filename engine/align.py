"""Bring one mesh over another: similarity by iterated closest points."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from engine.arrays import F64
from engine.mesh import Mesh

_SAMPLES = 2000
_ROUNDS = 60
_TRIMMED = 0.9


@dataclass(frozen=True, eq=False)
class Alignment:
    """A similarity that takes points of one mesh to the frame of another.

    Parameters
    ----------
    matrix : (4, 4), x' = matrix @ (x, 1).
    rms : root mean square distance of the nine tenths of the vertices that fit best to the other
        surface's vertices, in its mesh units.
    """

    matrix: F64
    rms: float

    @property
    def scale(self) -> float:
        """How much longer lengths become."""
        return float(np.cbrt(np.linalg.det(self.matrix[:3, :3])))

    def moved(self, points: F64) -> F64:
        """Return the points (p, 3) in the other frame."""
        return np.asarray(points @ self.matrix[:3, :3].T + self.matrix[:3, 3])


def align(mesh: Mesh, other: Mesh, scale: bool = True) -> Alignment:
    """Return the similarity that brings `mesh` over `other` best.

    Starts are tried: as they lie, middles put together, and the four proper matches of their
    principal axes; each is improved by iterated closest points.

    Parameters
    ----------
    mesh, other : what is moved, and what it is brought over.
    scale : whether sizes may differ.

    Source: Besl and McKay 1992; Umeyama 1991 for each step.
    """
    x, y = _sampled(mesh), _sampled(other)
    tree = cKDTree(other.vertices[other.topology.used_vertices])
    found = [_improved(start, x, tree, scale) for start in _starts(x, y, scale)]
    return min(found, key=lambda alignment: alignment.rms)


def _sampled(mesh: Mesh) -> F64:
    x = mesh.vertices[mesh.topology.used_vertices]
    return np.asarray(x[:: max(1, len(x) // _SAMPLES)])


def _starts(x: F64, y: F64, scale: bool) -> list[F64]:
    middle_x, middle_y = x.mean(axis=0), y.mean(axis=0)
    size_x, axes_x = np.linalg.eigh(np.cov((x - middle_x).T))
    size_y, axes_y = np.linalg.eigh(np.cov((y - middle_y).T))
    ratio = np.sqrt(size_y.sum() / max(size_x.sum(), 1e-300)) if scale else 1.0
    starts = [np.eye(4), _similarity(np.eye(3), ratio, middle_x, middle_y)]
    for signs in product((1, -1), repeat=3):
        R = axes_y @ np.diag(signs) @ axes_x.T
        if np.linalg.det(R) > 0:
            starts.append(_similarity(R, ratio, middle_x, middle_y))
    return starts


def _similarity(R: F64, ratio: float, start: F64, end: F64) -> F64:
    matrix = np.eye(4)
    matrix[:3, :3] = ratio * R
    matrix[:3, 3] = end - ratio * R @ start
    return matrix


def _improved(matrix: F64, x: F64, tree: cKDTree, scale: bool) -> Alignment:
    last = np.inf
    for _ in range(_ROUNDS):
        at = x @ matrix[:3, :3].T + matrix[:3, 3]
        away, nearest = tree.query(at)
        fits = away <= np.quantile(away, _TRIMMED)
        rms = float(np.sqrt((away[fits] ** 2).mean()))
        if rms >= last * (1 - 1e-4):
            break
        last = rms
        matrix = _fitted(x[fits], np.asarray(tree.data)[nearest[fits]], scale)
    return Alignment(matrix, last)


def _fitted(x: F64, y: F64, scale: bool) -> F64:
    """Return the similarity that takes points x (p, 3) to y best (Umeyama)."""
    middle_x, middle_y = x.mean(axis=0), y.mean(axis=0)
    u, s, vt = np.linalg.svd((y - middle_y).T @ (x - middle_x))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    spread = float(((x - middle_x) ** 2).sum())
    ratio = float((s * sign).sum() / spread) if scale and spread > 0 else 1.0
    return _similarity(u @ np.diag(sign) @ vt, ratio, middle_x, middle_y)
