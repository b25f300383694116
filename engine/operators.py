"""K, M and delta (Eqs. 1-3): cotangent stiffness, vertex areas, Laplacian coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from engine.arrays import F64, I64
from engine.mesh import Mesh


def cotangent_stiffness(mesh: Mesh) -> sp.csr_array:
    """Return the cotangent stiffness matrix K of the whole mesh.

    K_ij = -(cot a_ij + cot b_ij) / 2, K_ii = -sum_j K_ij.

    Returns
    -------
    (n, n) CSR, symmetric positive semidefinite, rows sum to 0, without a unit.
        A triangle without area contributes nothing.

    Source: Orbay et al. 2012, Eq. 2 (the sign of Eq. 1 is corrected: w_ij is negative).
    """
    return stiffness(mesh.vertices, mesh.faces)


def vertex_areas(mesh: Mesh) -> F64:
    """Return the lumped mixed Voronoi areas M of the whole mesh, (n,), in mesh units squared.

    They sum to the surface area. In an obtuse triangle the obtuse corner gets half of the
    triangle and the others a quarter each. Source: Meyer et al. 2002, Fig. 4.
    """
    return areas(mesh.vertices, mesh.faces)


def corner_cotangents(x: F64, faces: I64) -> tuple[F64, F64]:
    """Return the cotangent at each corner, (f, 3), and twice the area of each face, (f,).

    The cotangents of a face without area are 0.
    """
    # Edge k is opposite to corner k.
    e = [x[faces[:, (k + 2) % 3]] - x[faces[:, (k + 1) % 3]] for k in range(3)]
    double = np.linalg.norm(np.cross(e[1], e[2]), axis=1)
    dots = np.stack([-np.einsum("fi,fi->f", e[(k + 1) % 3], e[(k + 2) % 3]) for k in range(3)], 1)
    longest = np.max([np.einsum("fi,fi->f", a, a) for a in e], axis=0)
    flat = double <= 1e-14 * longest
    safe = np.where(flat, 1.0, double)
    cotangents = np.where(flat[:, None], 0.0, dots / safe[:, None])
    return cotangents, double


def stiffness(x: F64, faces: I64) -> sp.csr_array:
    """Return K of positions x (n, 3) and faces (f, 3); see `cotangent_stiffness`."""
    half = corner_cotangents(x, faces)[0] / 2
    n = len(x)
    i = faces[:, [1, 2, 0]].ravel()
    j = faces[:, [2, 0, 1]].ravel()
    w = half.ravel()
    k = sp.coo_array(
        (
            np.concatenate([-w, -w, w, w]),
            (np.concatenate([i, j, i, j]), np.concatenate([j, i, i, j])),
        ),
        shape=(n, n),
    )
    return sp.csr_array(k)


def areas(x: F64, faces: I64) -> F64:
    """Return the mixed Voronoi areas (n,) of positions x (n, 3); see `vertex_areas`."""
    cot, double = corner_cotangents(x, faces)
    squared = np.stack(
        [
            np.sum((x[faces[:, (k + 2) % 3]] - x[faces[:, (k + 1) % 3]]) ** 2, axis=1)
            for k in range(3)
        ],
        axis=1,
    )
    part = squared * cot / 8
    voronoi = np.stack(
        [part[:, 1] + part[:, 2], part[:, 2] + part[:, 0], part[:, 0] + part[:, 1]], 1
    )
    obtuse = cot < 0
    mixed = np.where(obtuse, double[:, None] / 4, double[:, None] / 8)
    share = np.where(obtuse.any(axis=1)[:, None], mixed, voronoi)
    return np.bincount(faces.ravel(), weights=share.ravel(), minlength=len(x))


def laplacian_coordinates(stiffness: sp.csr_array, areas: F64, x: F64) -> F64:
    """Return delta = M^-1 K x, (n, 3): along the outward normal, with the length 2 H.

    Source: Orbay et al. 2012, Eq. 3. In units of 1 / mesh unit.
    """
    return np.asarray((stiffness @ x) / areas[:, None])


def mean_curvature(mesh: Mesh) -> F64:
    """Return |H| = |delta| / 2 at each vertex, (n,), in 1 / mesh unit; 0 where there is no area."""
    m = vertex_areas(mesh)
    kx = cotangent_stiffness(mesh) @ mesh.vertices
    length = np.linalg.norm(kx, axis=1)
    return np.divide(length, 2 * m, out=np.zeros_like(m), where=m > 0)


@dataclass(frozen=True, eq=False)
class Laplacian:
    """K and M of a patch, and a sentence when another than the plain cotangent one was taken.

    Parameters
    ----------
    stiffness : K, (n, n) CSR.
    areas : M, (n,), all positive.
    report : "" or what was done and why.
    """

    stiffness: sp.csr_array
    areas: F64
    report: str = ""


def laplacian(x: F64, faces: I64) -> Laplacian:
    """Return K and M of a patch with positions x (n, 3), the robust ones where it is needed."""
    m = areas(x, faces)
    floor = 1e-12 * float(m.mean())
    return Laplacian(stiffness(x, faces), np.maximum(m, floor))
