"""A patch dragged: what goes with it, what stays, and how the surface passes on."""

from __future__ import annotations

import numpy as np
import pytest

from engine import Mesh, SketchError, drag_patch
from engine.errors import RegionError
from engine.measure import edge_stretch, rim_dihedral
from engine.patch_drag import checked_similarity


def plate(side: int = 61, waves: float = 0.0) -> Mesh:
    """A plate of 60 x 60 mm with irregular triangles, and fine waves of that height on it."""
    rng = np.random.default_rng(11)
    x, y = np.meshgrid(np.linspace(0, 60, side), np.linspace(0, 60, side))
    flat = np.column_stack([x.ravel(), y.ravel()])
    flat += 0.25 * (60 / (side - 1)) * rng.uniform(-1, 1, flat.shape)
    z = waves * np.sin(2 * np.pi * flat[:, 0] / 6) * np.sin(2 * np.pi * flat[:, 1] / 6)
    i = np.arange(side * side).reshape(side, side)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(np.column_stack([flat, z]), faces)


def rings(mesh: Mesh, outer: float = 24.0, inner: float = 7.0) -> tuple[np.ndarray, np.ndarray]:
    away = np.linalg.norm(mesh.vertices[:, :2] - 30, axis=1)
    return np.flatnonzero(away < outer), np.flatnonzero(away < inner)


def motion(angle: float = 0.0, axis: int = 0, scale: float = 1.0, by=(0.0, 0.0, 0.0)) -> np.ndarray:
    """A similarity about the middle of the plate."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    M = np.eye(4)
    M[:3, :3] = scale * R
    middle = np.array([30.0, 30.0, 0.0])
    M[:3, 3] = middle - M[:3, :3] @ middle + np.array(by)
    return M


MOTIONS = {
    "lift": motion(by=(0, 0, 8)),
    "shift": motion(by=(5, 3, 0)),
    "tilt": motion(35),
    "twist": motion(50, axis=2),
    "grow": motion(scale=1.5),
    "all": motion(20, scale=0.8, by=(2, 0, 4)),
}


@pytest.mark.parametrize("method", ["smooth", "rigid"])
@pytest.mark.parametrize("name", MOTIONS)
def test_the_patch_goes_and_the_rest_stays(name: str, method: str) -> None:
    mesh = plate()
    roi, patch = rings(mesh)
    M = MOTIONS[name]
    after = drag_patch(mesh, roi, patch, M, method=method)
    outside = np.setdiff1d(np.arange(mesh.n), roi)
    assert after.faces is mesh.faces
    assert (after.vertices[outside] == mesh.vertices[outside]).all()
    gone = mesh.vertices[patch] @ M[:3, :3].T + M[:3, 3]
    assert after.vertices[patch] == pytest.approx(gone, abs=1e-9)


@pytest.mark.parametrize("method", ["smooth", "rigid"])
@pytest.mark.parametrize("name", ["lift", "tilt", "grow"])
def test_there_is_no_crease(name: str, method: str) -> None:
    """With finer triangles a crease stays as sharp; a bend is shared by more edges."""
    bends = []
    for side in (41, 81):
        mesh = plate(side)
        roi, patch = rings(mesh)
        after = drag_patch(mesh, roi, patch, MOTIONS[name], method=method)
        bends.append([rim_dihedral(after, border, 90) for border in (roi, patch)])
    coarse, fine = np.array(bends)
    assert (fine < 0.75 * coarse + 1e-3).all(), (coarse, fine)


def test_standing_still_changes_no_bit() -> None:
    mesh = plate(waves=0.5)
    roi, patch = rings(mesh)
    for method in ("smooth", "rigid"):
        after = drag_patch(mesh, roi, patch, np.eye(4), method=method)
        assert (after.vertices == mesh.vertices).all()


@pytest.mark.parametrize("method", ["smooth", "rigid"])
def test_details_ride_along_and_turn_with_the_form(method: str) -> None:
    bare, waves = plate(), plate(waves=0.4)
    roi, patch = rings(bare)
    M = motion(40, by=(0, 0, 6))
    plain = drag_patch(bare, roi, patch, M, method=method)
    wavy = drag_patch(waves, roi, patch, M, method=method)
    free = np.setdiff1d(roi, patch)
    before = waves.vertices[free, 2]
    after = ((wavy.vertices - plain.vertices)[free] * plain.vertex_normals[free]).sum(axis=1)
    assert np.corrcoef(before, after)[0, 1] > 0.93
    assert np.std(after) == pytest.approx(np.std(before), rel=0.2)


def test_a_region_moved_as_a_whole_by_its_surroundings_keeps_its_form() -> None:
    """A patch all around turns the free part like a rigid body, in both methods."""
    mesh = plate(waves=0.5)
    away = np.linalg.norm(mesh.vertices[:, :2] - 30, axis=1)
    roi, patch = np.flatnonzero(away < 26), np.flatnonzero((away < 26) & (away > 12))
    M = motion(by=(3, -2, 9))
    hole = np.flatnonzero(away <= 12)
    after = drag_patch(mesh, roi, patch, M, method="rigid")
    assert after.vertices[hole] == pytest.approx(mesh.vertices[hole] + M[:3, 3], abs=1e-8)


def test_rigid_stretches_less_than_smooth() -> None:
    mesh = plate()
    roi, patch = rings(mesh)
    M = motion(60)
    spread = {}
    for method in ("smooth", "rigid"):
        stretch = edge_stretch(mesh, drag_patch(mesh, roi, patch, M, method=method), roi)
        spread[method] = stretch.p95 / stretch.p5
    assert spread["rigid"] < spread["smooth"]


def test_renumbering_and_scale_do_not_matter() -> None:
    mesh = plate(31, waves=0.5)
    roi, patch = rings(mesh)
    M = MOTIONS["all"]
    after = drag_patch(mesh, roi, patch, M)
    order = np.random.default_rng(2).permutation(mesh.n)
    place = np.argsort(order)
    S = np.diag([1e-3, 1e-3, 1e-3, 1.0])
    other = Mesh(1e-3 * mesh.vertices[order], place[mesh.faces])
    moved = drag_patch(other, np.sort(place[roi]), np.sort(place[patch]), S @ M @ np.linalg.inv(S))
    assert 1e3 * moved.vertices[place] == pytest.approx(after.vertices, abs=1e-6)


def test_what_cannot_be_is_refused() -> None:
    mesh = plate(31)
    roi, patch = rings(mesh)
    with pytest.raises(RegionError, match="smaller handle"):
        drag_patch(mesh, roi, roi, MOTIONS["lift"])
    with pytest.raises(SketchError, match="16 finite"):
        checked_similarity([1.0, np.nan])
    for wrong in (np.diag([1.0, 1, -1, 1]), np.diag([99.0, 99, 99, 1]), np.diag([1.0, 1, 1, 2])):
        with pytest.raises(SketchError, match="inside out"):
            drag_patch(mesh, roi, patch, wrong)
