"""The LSE rows and the handles on them: what is free, what is exact, what stays (Eqs. 7, 8, 17)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine import Mesh, Region, Run, cholmod, cotangent_stiffness, vertex_areas
from engine.arap import Polish
from engine.arrays import F64, I64
from engine.condensed import Condensed
from engine.handles import Handles, Responses, Rows
from engine.lse import Lse, fit_weights, lse_rows, stiffening
from engine.rectify import ring_products

from .shapes import inner, plate, sphere, tube
from .surfaces import flat


def rows_of(mesh: Mesh) -> tuple[F64, I64]:
    """Dense-free product with all rows of the inner vertices, as a function's matrix."""
    ids = np.flatnonzero(~mesh.topology.border_vertices)
    K, M = cotangent_stiffness(mesh), vertex_areas(mesh)
    return lse_rows(mesh.vertices, K, M, ids, np.ones(len(ids), dtype=bool)), ids


MESHES = {"plate": plate(20, wave=0.05), "sphere": sphere(3), "tube": tube(30, 20)}


@pytest.fixture(params=list(MESHES))
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]


def scale_of(A: F64, mesh: Mesh) -> float:
    """How large a residual without meaning is: that of a random shape of the same size."""
    noise = np.random.default_rng(0).normal(size=mesh.vertices.size)
    return float(np.linalg.norm(A @ noise) / np.linalg.norm(noise)) * mesh.diagonal


class TestRows:
    def test_rest_shape_translation_and_scale_have_no_residual(self, mesh: Mesh) -> None:
        A, _ = rows_of(mesh)
        for change in (
            mesh.vertices,
            mesh.vertices + np.array([3, -5, 7]),
            2.5 * mesh.vertices + 1,
        ):
            assert np.linalg.norm(A @ change.ravel()) < 1e-11 * scale_of(A, mesh)

    def test_a_small_rotation_leaves_a_residual_of_second_order(self, mesh: Mesh) -> None:
        A, _ = rows_of(mesh)
        axis = np.array([1.0, 0.5, -0.3])
        left = [
            np.linalg.norm(
                A @ (mesh.vertices @ Rotation.from_rotvec(a * axis).as_matrix().T).ravel()
            )
            for a in (0.04, 0.02, 0.01)
        ]
        assert left[0] / left[1] == pytest.approx(4, rel=0.02)
        assert left[1] / left[2] == pytest.approx(4, rel=0.02)

    def test_a_shear_is_not_free(self, mesh: Mesh) -> None:
        A, _ = rows_of(mesh)
        sheared = mesh.vertices @ np.array([[1, 0, 0], [0.3, 1, 0], [0, 0, 1.0]])
        turned = mesh.vertices @ Rotation.from_rotvec([0, 0, 0.01]).as_matrix().T
        assert np.linalg.norm(A @ sheared.ravel()) > 3 * np.linalg.norm(A @ turned.ravel())

    def test_negative_and_huge_cotangents_do_not_rule_a_fit(self) -> None:
        w = fit_weights(np.array([-1.0, -1.0, 5.0, -1e9, -1.0]), np.array([0, 3]))
        assert (w > 0).all()
        assert w[3] / w[4] <= 100.0 + 1e-9

    def test_a_ring_on_a_line_gives_finite_rows(self) -> None:
        x = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1e-17, 0], [1, 1, 0.0]])
        mesh = Mesh(x, [[0, 1, 3], [1, 2, 3], [0, 1, 4]])
        A = lse_rows(x, cotangent_stiffness(mesh), np.ones(5), np.array([1]), np.ones(1, bool))
        assert np.isfinite(A.data).all()


def pulled(lse: Lse, region: Region, ids: I64, by: F64) -> F64:
    """Displacements when vertices `ids` of the region are moved by `by`, mesh units."""
    at = np.searchsorted(region.roi, ids)
    rows = Rows(
        np.repeat(np.arange(len(ids)), 3),
        np.tile(np.eye(3), (len(ids), 1)),
        (np.broadcast_to(by, (len(ids), 3)) / region.scale).ravel(),
        np.zeros(3 * len(ids)),
    )
    return Handles(lse, at, Run()).displacement(rows) * region.scale


class TestRegion:
    mesh = plate(25, wave=0.02)
    region = Region(mesh, inner(mesh, 0.15, 0.85))
    lse = Lse(region, region.x[: region.m])

    def test_the_matrix_is_symmetric_and_only_rest_is_free(self) -> None:
        N = self.lse.matrix
        assert abs(N - N.T).max() <= 1e-12 * abs(N).max()
        assert self.lse.factor.negative == 0

    def test_handles_reach_their_place_and_the_energy_is_least(self) -> None:
        middle = self.region.roi[[200, 240, 260]]
        d = pulled(self.lse, self.region, middle, np.array([0.0, 0.0, 0.1]))
        at = np.searchsorted(self.region.roi, middle)
        assert np.allclose(d[at], [0, 0, 0.1], atol=1e-9)
        force = self.lse.matrix @ d.ravel()
        free = np.ones(len(d), dtype=bool)
        free[at] = False
        assert np.linalg.norm(force.reshape(-1, 3)[free]) < 1e-6 * np.linalg.norm(force)

    @pytest.mark.skipif(not cholmod.usable(), reason="CHOLMOD is not installed")
    def test_all_ways_to_answer_agree(self) -> None:
        at = np.array([100, 200, 210, 330])
        rng = np.random.default_rng(0)
        directions = rng.normal(size=(8, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        rows = Rows(np.repeat(np.arange(4), 2), directions, rng.normal(size=8), np.zeros(8))
        unit = (3 * at[:, None] + np.arange(3)).ravel()
        condensed = Handles(self.lse, at, Run(), Condensed(self.lse.matrix, unit))
        roomy = Handles(self.lse, at, Run(), Responses(self.lse, unit, Run()))
        tight = Handles(self.lse, at, Run(), Responses(self.lse, unit, Run(), largest_bytes=0))
        first = condensed.displacement(rows)
        for other in (roomy, tight):
            assert np.abs(other.displacement(rows) - first).max() < 1e-8 * np.abs(first).max()

    def test_separate_parts_and_many_anchors(self) -> None:
        mesh = plate(41)
        x = mesh.vertices
        apart = np.flatnonzero(((x[:, 0] < 0.4) | (x[:, 0] > 0.6)) & ~mesh.topology.border_vertices)
        region = Region(mesh, apart)
        lse = Lse(region, region.x[: region.m])
        ids = region.roi[np.linspace(0, region.m - 1, 30).astype(int)]
        d = pulled(lse, region, ids, np.array([0.0, 0.02, 0.1]))
        assert np.allclose(d[np.searchsorted(region.roi, ids)], [0, 0.02, 0.1], atol=1e-8)

    def test_the_original_metric_is_at_hand(self) -> None:
        flat = self.region.x[: self.region.m] * [1, 1, 0.0]
        lse = Lse(self.region, flat)
        other = lse.on_original
        assert (other.positions == lse.positions).all()
        assert abs(other.stiffness - self.region.laplacian.stiffness).max() == 0
        ids = self.region.roi[[100, 222]]
        one = pulled(lse, self.region, ids, np.array([0, 0, 0.1]))
        two = pulled(other, self.region, ids, np.array([0, 0, 0.1]))
        assert 0 < np.abs(one - two).max() < 0.02

    def test_no_way_to_go_moves_nothing(self) -> None:
        assert not pulled(self.lse, self.region, self.region.roi[[100]], np.zeros(3)).any()

    def test_the_displacement_is_linear_in_the_way(self) -> None:
        ids = self.region.roi[[100, 222]]
        one = pulled(self.lse, self.region, ids, np.array([0.01, 0.02, 0.05]))
        assert np.allclose(
            3 * one, pulled(self.lse, self.region, ids, np.array([0.03, 0.06, 0.15])), atol=1e-10
        )

    def test_handles_that_disagree_meet_in_the_middle(self) -> None:
        at = np.array([210])
        rows = Rows(
            np.zeros(4, dtype=np.int64),
            np.array([[0, 0, 1.0], [0, 0, 1.0], [1, 0, 0], [0, 1, 0]]),
            np.array([0.1, 0.2, 0, 0]),
            np.zeros(4),
        )
        d = Handles(self.lse, at, Run()).displacement(rows)
        assert d[210] == pytest.approx([0, 0, 0.15], abs=1e-6)


def edge_ratios(mesh: Mesh, moved: F64, region: Region, apart_from: I64) -> F64:
    y = mesh.vertices.copy()
    y[region.roi] += moved
    inside = np.isin(mesh.topology.edges, region.roi).any(axis=1)
    rigid = np.isin(mesh.topology.edges, apart_from).all(axis=1)
    a, b = mesh.topology.edges[inside & ~rigid].T
    before = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    return np.asarray(np.percentile(np.linalg.norm(y[a] - y[b], axis=1) / before, [5, 95]))


def test_polish_takes_out_the_stretch_of_a_turn_by_120_degrees() -> None:
    mesh = tube(121, 24, radius=0.06)
    region = Region(mesh, inner(mesh, 0.3, 1.9, axis=2))
    lse = Lse(region, region.x[: region.m])
    top = np.flatnonzero(mesh.vertices[region.roi, 2] > 1.6)
    radius = 1.3 / np.radians(120)
    turn = Rotation.from_euler("x", 120, degrees=True)
    bend = np.array([0, -radius * 1.5, 0.3 + radius * np.sqrt(0.75)])
    start = mesh.vertices[region.roi][top]
    way = turn.apply(start - [0, 0, 1.6]) + bend - start
    moved = pulled(lse, region, region.roi[top], way) / region.scale
    linear = edge_ratios(mesh, moved * region.scale, region, region.roi[top])
    rings = ring_products(lse.positions, lse.stiffness, np.arange(region.m))
    relaxed = Polish(lse, rings, top).relax(moved, 30)
    polished = edge_ratios(mesh, relaxed * region.scale, region, region.roi[top])
    assert linear[0] < 0.7
    assert linear[1] > 1.19
    assert polished[0] >= 0.88
    assert polished[1] <= 1.19
    assert np.allclose(relaxed[top], moved[top], atol=1e-12)


def test_polish_leaves_the_rest_shape_alone() -> None:
    mesh = plate(20, wave=0.05)
    region = Region(mesh, inner(mesh, 0.1, 0.9))
    lse = Lse(region, region.x[: region.m])
    rings = ring_products(lse.positions, lse.stiffness, np.arange(region.m))
    still = np.zeros((region.m, 3))
    assert np.abs(Polish(lse, rings, np.array([50, 51])).relax(still, 5)).max() < 1e-10


def test_surface_is_stiffer_towards_its_rim_and_each_part_by_itself() -> None:
    mesh = flat(2500)
    middle = np.linalg.norm(mesh.vertices[:, :2] - [0.3, 0.5], axis=1)
    other = np.linalg.norm(mesh.vertices[:, :2] - [0.8, 0.5], axis=1)
    region = Region(mesh, np.flatnonzero((middle < 0.25) | (other < 0.12)))
    lap = region.laplacian
    near = np.arange(region.m + len(region.rim))
    D = stiffening(lap.stiffness, lap.areas, region.m, near)
    away = np.minimum(middle / 0.25, other / 0.12)[region.patch[: len(near)]]
    assert (D >= 1).all()
    for part in (middle, other):
        inside = part[region.patch[: len(near)]] < 0.28
        assert (D[inside & (away < 0.6)] == 1).all()
        assert D[inside & (near >= region.m)].min() > 2
    ring = np.argsort(away[: region.m])[-40:]
    assert D[ring].mean() > D[: region.m].mean()


def test_bend_of_a_change_fades_out_at_the_rim(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = flat(3600)
    distance = np.linalg.norm(mesh.vertices[:, :2] - 0.5, axis=1)
    region = Region(mesh, np.flatnonzero(distance < 0.4))
    from_middle = distance[region.patch]
    halfway = (from_middle > 0.15) & (from_middle < 0.25)
    pulled = int(np.argmin(distance[region.roi]))

    def bend_at_rim() -> float:
        """Bend at the rim beside that halfway to it, for a pull in the middle."""
        lse = Lse(region, region.x[: region.m])
        force = np.zeros(3 * region.m)
        force[3 * pulled + 2] = 1.0
        d = np.zeros((len(region.x), 3))
        d[: region.m] = lse.factor.solve(force).reshape(-1, 3)
        bend = np.abs((lse.stiffness @ d)[:, 2]) / lse.areas
        at_rim = bend[region.m : region.m + len(region.rim)]
        return float(np.median(at_rim) / np.median(bend[halfway]))

    faded = bend_at_rim()
    monkeypatch.setattr("engine.lse._SOFT", 0.0)
    alike = bend_at_rim()
    assert faded < 0.5 < 1.5 < alike
