"""K, M and delta (Eqs. 1-3): cotangent stiffness, vertex areas, Laplacian coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import robust_laplacian
import scipy.sparse as sp

from engine.arrays import B1, F64, I64
from engine.errors import MeshError
from engine.mesh import Mesh

# Twice the area over the longest edge squared: below, a face counts as having no area.
FLAT = 1e-12
# Cotangent of half a degree.
STEEPEST_COTANGENT = 115.0
# Least area of a vertex, as a share of the mean, so that M can be divided by.
AREA_FLOOR = 1e-9


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


@dataclass(frozen=True, eq=False)
class Corners:
    """What K, M and their check need of every face.

    Parameters
    ----------
    cotangents : (f, 3) at each corner; 0 in a face without area.
    double : (f,) twice the area.
    squared : (f, 3) squared length of the edge opposite to each corner.
    flat : (f,) whether the face counts as having no area.
    """

    cotangents: F64
    double: F64
    squared: F64
    flat: B1


def corners(x: F64, faces: I64) -> Corners:
    """Return cotangents, areas and edge lengths of positions x (n, 3) and faces (f, 3)."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    bc, ca, ab = c - b, a - c, b - a
    normal = np.cross(ab, ca)
    double = np.sqrt(np.einsum("fi,fi->f", normal, normal))
    squared = np.stack([np.einsum("fi,fi->f", e, e) for e in (bc, ca, ab)], axis=1)
    dots = -np.stack([np.einsum("fi,fi->f", e, g) for e, g in ((ca, ab), (ab, bc), (bc, ca))], 1)
    flat: B1 = np.less_equal(double, FLAT * squared.max(axis=1))
    cotangents = np.where(flat[:, None], 0.0, dots / np.where(flat, 1.0, double)[:, None])
    return Corners(cotangents, double, squared, flat)


def stiffness(x: F64, faces: I64, at: Corners | None = None) -> sp.csr_array:
    """Return K of positions x (n, 3) and faces (f, 3); see `cotangent_stiffness`."""
    at = at or corners(x, faces)
    n = len(x)
    i, j = faces[:, [1, 2, 0]].ravel(), faces[:, [2, 0, 1]].ravel()
    w = at.cotangents.ravel() / 2
    diagonal = np.bincount(i, w, n) + np.bincount(j, w, n)
    every = np.arange(n)
    k = sp.coo_array(
        (
            np.concatenate([-w, -w, diagonal]),
            (np.concatenate([i, j, every]), np.concatenate([j, i, every])),
        ),
        shape=(n, n),
    )
    return sp.csr_array(k)


def areas(x: F64, faces: I64, at: Corners | None = None) -> F64:
    """Return the mixed Voronoi areas (n,) of positions x (n, 3), faces (f, 3); see `vertex_areas`.

    `at` are the `corners` of the same, where they are known.
    """
    at = at or corners(x, faces)
    part = at.squared * at.cotangents / 8
    voronoi = part[:, [1, 2, 0]] + part[:, [2, 0, 1]]
    obtuse: B1 = np.less(at.cotangents, 0.0)
    mixed = np.where(obtuse, at.double[:, None] / 4, at.double[:, None] / 8)
    share = np.where(np.any(obtuse, axis=1)[:, None], mixed, voronoi)
    return np.bincount(faces.ravel(), weights=share.ravel(), minlength=len(x)).astype(np.float64)


def laplacian_coordinates(stiffness: sp.csr_array, areas: F64, x: F64) -> F64:
    """Return delta = M^-1 K x, (n, 3): along the outward normal, with the length 2 H.

    Parameters
    ----------
    stiffness, areas : K (n, n) and M (n,), all areas positive.
    x : (n, 3) positions.

    Source: Orbay et al. 2012, Eq. 3. In units of 1 / mesh unit.
    """
    return np.asarray((stiffness @ x) / areas[:, None])


def mean_curvature(mesh: Mesh) -> F64:
    """Return |H| = |delta| / 2 at each vertex, (n,), in 1 / mesh unit; 0 where there is no area."""
    m = vertex_areas(mesh)
    kx = cotangent_stiffness(mesh) @ mesh.vertices
    length = np.linalg.norm(kx, axis=1)
    curvature: F64 = np.divide(length, 2 * m, out=np.zeros_like(m), where=m > 0)
    return curvature


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
    """Return K and M of a patch with positions x (n, 3): cotangents, or the robust ones if needed.

    Where triangles are so thin that cotangents are useless (see `trouble`), K and M are those
    of the intrinsic Delaunay triangulation of the same surface, its edges lengthened by 1e-5 of the
    mean where a triangle is degenerate. Its weights are never negative, and it agrees with the
    cotangent matrix on a well-shaped mesh.

    Source: Sharp and Crane 2020, "A Laplacian for nonmanifold triangle meshes" (robust-laplacian).
    """
    a, b, c = faces.T
    proper = faces[(a != b) & (b != c) & (c != a)]
    at = corners(x, proper)
    k, m = stiffness(x, proper, at), areas(x, proper, at)
    why = trouble(at, k)
    if not why:
        return Laplacian(k, np.maximum(m, AREA_FLOOR * float(m.mean())))
    k, m = robust(x, proper)
    m = np.maximum(m, AREA_FLOOR * float(m.mean()))
    return Laplacian(k, m, f"{why}; an intrinsic Delaunay Laplacian is used there.")


def trouble(at: Corners, k: sp.csr_array) -> str:
    """Return why plain cotangent weights would do harm here, or "" when they are good.

    They do where a face has no area, where an angle is below half a degree, and where the negative
    weights at a vertex exceed half of its positive diagonal. A few mildly negative weights (obtuse
    triangles side by side) are right and stay.
    """
    flat = int(np.count_nonzero(at.flat))
    if flat:
        return f"{flat} faces have no area"
    thin = int(np.count_nonzero(np.abs(at.cotangents).max(axis=1) > STEEPEST_COTANGENT))
    if thin:
        return f"{thin} faces are needles or slivers"
    entries = k.tocoo()
    negative = (entries.row != entries.col) & (entries.data > 0)
    sums = np.bincount(entries.row[negative], entries.data[negative], minlength=k.shape[0])
    bad = int(np.count_nonzero(sums > 0.5 * np.abs(k.diagonal())))
    return f"the cotangent weights of {bad} vertices are mostly negative" if bad else ""


def robust(x: F64, faces: I64) -> tuple[sp.csr_array, F64]:
    """Return K (n, n) and M (n,) of x (n, 3) by the tufted intrinsic Delaunay Laplacian.

    Both are 0 at vertices in no face.

    Raises
    ------
    MeshError
        Even that cannot be built.
    """
    used = np.unique(faces)
    local = np.full(len(x), -1, dtype=np.int64)
    local[used] = np.arange(len(used))
    try:
        inner, mass = robust_laplacian.mesh_laplacian(x[used], local[faces])
    except (RuntimeError, ValueError) as error:
        raise MeshError(
            "No Laplacian can be built where the region lies. Clean the mesh there."
        ) from error
    c = inner.tocoo()
    n = len(x)
    k = sp.csr_array(sp.coo_array((c.data, (used[c.row], used[c.col])), shape=(n, n)))
    m = np.zeros(n)
    m[used] = mass.diagonal()
    if not (np.isfinite(k.data).all() and np.isfinite(m).all()):
        raise MeshError("No Laplacian can be built where the region lies. Clean the mesh there.")
    return k, m
