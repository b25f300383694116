"""Details on a deformed surface: no crease at the rim, the features' height kept (Eqs. 18-20)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench.rim import added_folds, pulled, regions
from engine import EditOptions, Mesh, SketchEdit, decompose
from engine.arrays import B1, F64, I64
from engine.detail import Decomposition
from engine.details import Details
from engine.intersections import self_intersections
from engine.measure import dihedral_angles, feature_amplitude, feature_heights
from engine.prepared import PreparedEdit
from engine.rectify import ring_products, ring_rotations, turned
from tests.engine.shapes import inner, plate
from tests.engine.surfaces import real


def as_printed(prepared: PreparedEdit, moved: F64) -> F64:
    """Eq. 20 taken literally: x' + L^-1 (R delta_high), for a displacement in mesh units."""
    parts, surface = prepared.decomposition, prepared._surface
    x = surface.lse.positions.copy()
    x[: parts.m] += moved / parts.region.scale
    R = ring_rotations(surface.rings[: 3 * parts.m], x)
    high = parts.high(prepared.k)
    return parts.reconstruct(parts.surface(prepared.k) + moved, turned(R, high))


def placed(parts: Decomposition, positions: F64) -> F64:
    x = parts.region.mesh.vertices.copy()
    x[parts.roi] = positions
    return x


def border_faces(mesh: Mesh, roi: I64) -> B1:
    corners = np.isin(mesh.faces, roi)
    return np.asarray(corners.any(axis=1) & ~corners.all(axis=1))


def bend_at_rim(parts: Decomposition, before: F64, after: F64) -> float:
    """95th percentile of what an edit adds to the folds over the region's border, degrees."""
    mesh = parts.region.mesh
    border = border_faces(mesh, parts.roi)
    old, new = (dihedral_angles(mesh.with_vertices(x), border) for x in (before, after))
    return float(np.degrees(np.percentile(np.abs(new - old), 95)))


@pytest.mark.parametrize(
    ("name", "which"), [("hand_closed", 3), ("armadillo", 1), ("bunny_hr", 0), ("bunny_hr", 2)]
)
def test_details_that_turn_beside_the_rim_do_not_fold_it(
    shared_meshes: Path, name: str, which: int
) -> None:
    mesh = real(shared_meshes, f"{name}.obj")
    roi = list(regions(mesh, which + 1, len(name)))[which]
    parts = decompose(mesh, roi, modes=0)
    edit = pulled(parts)
    prepared = edit.prepare(mesh, None, parts)
    result = prepared.solve(edit.strokes)
    moved = result.level_vertices[parts.roi] - parts.base
    literal = placed(parts, as_printed(prepared, moved))
    found = bend_at_rim(parts, mesh.vertices, result.vertices)
    assert found < 0.35 * bend_at_rim(parts, mesh.vertices, literal)
    added = added_folds(mesh, result.vertices, parts.roi)
    assert added[0] < 0.8 * added[1:].max()


FLAT = plate(61)
# Ridges along y, ten of them over the plate.
RIDGES = FLAT.with_vertices(
    FLAT.vertices + [0, 0, 0.006] * np.sin(20 * np.pi * FLAT.vertices[:, :1])
)


@pytest.mark.parametrize("height", [0.01, 0.02])
def test_features_keep_their_height_where_the_form_waves_at_their_own_length(
    height: float,
) -> None:
    mesh, roi = RIDGES, inner(RIDGES, 0.08, 0.92)
    prepared = SketchEdit(roi, 0.0, ()).prepare(mesh)
    parts = prepared.decomposition
    x, y = parts.base[:, :2].T
    # In step with the features, and calm at the rim.
    calm = np.prod([np.sin(np.pi * np.clip((a - 0.08) / 0.84, 0, 1)) ** 2 for a in (x, y)], axis=0)
    moved = np.zeros((parts.m, 3))
    moved[:, 2] = height * calm * np.sin(20 * np.pi * x)
    level = mesh.with_vertices(placed(parts, parts.base + moved))

    def kept(shape: F64) -> float:
        plain = mesh.with_vertices(placed(parts, parts.base))
        heights = [
            feature_amplitude(
                feature_heights(below, whole, parts.roi), parts.areas, parts.region.stiffness_roi
            )
            for below, whole in ((plain, mesh), (level, mesh.with_vertices(shape)))
        ]
        return heights[1].rms / heights[0].rms

    shape = placed(parts, prepared.detailed(moved / parts.region.scale))
    found = kept(shape)
    literal = kept(placed(parts, as_printed(prepared, moved)))
    assert abs(found - 1) < 0.06
    assert abs(found - 1) < 0.6 * abs(literal - 1)
    assert len(self_intersections(mesh.with_vertices(shape), parts.roi)) == 0


def test_the_papers_rule_takes_its_equation_as_printed() -> None:
    mesh = plate(31, wave=0.02)
    options = EditOptions(rim="paper")
    prepared = SketchEdit(inner(mesh, 0.1, 0.9), 0.0, (), options).prepare(mesh)
    parts = prepared.decomposition
    moved = np.zeros((parts.m, 3))
    moved[:, 2] = 0.1 * np.sin(3 * parts.base[:, 0])
    found = prepared.detailed(moved / parts.region.scale)
    assert np.abs(found - as_printed(prepared, moved)).max() < 1e-12


def test_a_region_without_details_has_nothing_to_turn() -> None:
    mesh = plate(21)
    parts = decompose(mesh, inner(mesh, 0.1, 0.9), modes=0)
    flat = parts.region.x
    details = Details(parts, 0)
    rings = ring_products(flat, parts.region.laplacian.stiffness, details.rows)
    rolled = flat.copy()
    rolled[:, 2] += 0.2 * np.sin(4 * flat[:, 0])
    assert np.abs(details.turning(ring_rotations(rings, rolled))).max() < 1e-9


def test_what_is_added_at_the_rim_tells_a_crease_from_a_bend() -> None:
    mesh = plate(41)
    away = np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1)
    roi = np.flatnonzero(away < 0.35)
    rise = np.maximum(0.37 - away, 0.0)[:, None] * [0, 0, 1.0]
    crease = added_folds(mesh, mesh.vertices + rise, roi)
    bend = added_folds(mesh, mesh.vertices + 8 * rise**3, roi)
    assert crease[0] > 2 * crease[1:].max()
    assert bend[0] < 0.6 * bend[1:].max()
