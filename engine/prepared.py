"""An edit prepared: all that does not depend on its targets, and the way from targets on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from engine.arap import Polish
from engine.arrays import B1, F64, I64
from engine.decomposition import decompose_stream
from engine.detail import Decomposition
from engine.errors import SketchError, SolveError
from engine.handles import Handles, Rows
from engine.intersections import self_intersections
from engine.lse import Lse
from engine.measure import Stretch, edge_stretch
from engine.mesh import Mesh
from engine.mirror import Twins, mirrored_region
from engine.rectify import ring_products, ring_rotations, turned
from engine.run import Memo, Run
from engine.threads import while_polling
from engine.view import View

if TYPE_CHECKING:
    from engine.edit import EditOptions, Stroke

# Targets closer to their anchors than this many pixels ask for nothing.
_STILL_PX = 1e-7
# How far a vertex may go beyond what was drawn, in diagonals of the region.
_FARTHEST = 1.0


@dataclass(frozen=True, eq=False)
class EditResult:
    """What an edit gives.

    Parameters
    ----------
    level_vertices : (n, 3) the surface at the level, deformed, without the finer details.
    vertices : (n, 3) with the details put back.
    target_error_px : largest distance of a reprojected anchor from its target, px; with `amount`,
        from its share of the way there.
    mesh : the mesh before.
    roi : (m,) the vertices that could move.
    """

    level_vertices: F64
    vertices: F64
    target_error_px: float
    mesh: Mesh
    roi: I64

    @cached_property
    def stretch(self) -> Stretch:
        """How much the edges changed length."""
        return edge_stretch(self.mesh, self.mesh.with_vertices(self.vertices), self.roi)

    @cached_property
    def self_intersections(self) -> I64:
        """Pairs of faces that run through each other now and did not before, (p, 2)."""
        after = self_intersections(self.mesh.with_vertices(self.vertices), self.roi)
        if len(after) == 0:
            return after
        before = self_intersections(self.mesh, self.roi)
        f = len(self.mesh.faces)
        new = ~np.isin(after[:, 0] * f + after[:, 1], before[:, 0] * f + before[:, 1])
        return np.asarray(after[new])


def prepare_edit(
    mesh: Mesh,
    roi: I64,
    level: float,
    anchors: Sequence[I64],
    options: EditOptions,
    run: Run,
    decomposition: Decomposition | None = None,
) -> PreparedEdit:
    """Prepare an edit; what was prepared before with the same inputs comes from `run.memo`.

    Parameters
    ----------
    anchors : (c,) vertex ids of each stroke; none prepares what the anchors do not change.
    """
    roi = np.asarray(roi, dtype=np.int64)
    chains = tuple(np.asarray(chain, dtype=np.int64) for chain in anchors)
    kept: Memo = run.memo.get("prepared edits", lambda: Memo(2))
    key = (mesh.digest, roi.tobytes(), level, tuple(c.tobytes() for c in chains), options)
    return kept.get(key, lambda: _prepared(mesh, roi, level, chains, options, run, decomposition))


def _prepared(
    mesh: Mesh,
    roi: I64,
    level: float,
    chains: tuple[I64, ...],
    options: EditOptions,
    run: Run,
    decomposition: Decomposition | None,
) -> PreparedEdit:
    if options.mirror:
        roi = mirrored_region(mesh, roi, options.mirror)
    surface = _level_surface(mesh, roi, level, options, run, decomposition)
    inside = surface.decomposition.roi
    twins = Twins(mesh, inside, options.mirror) if options.mirror else None
    asked = [chain for chain in (*chains, _pins(options)) if len(chain)]
    if twins is not None:
        asked += [twins.of(chain) for chain in asked]
    ids = np.concatenate([np.zeros(0, dtype=np.int64), *asked])
    moving = np.unique(np.searchsorted(inside, ids[np.isin(ids, inside)]))
    if len(chains) and len(moving) == 0:
        raise SketchError(
            "No anchor of the strokes can move: they lie outside the region or on an open border. "
            "Draw the source curve inside the region."
        )
    handles = surface.handles.get(moving.tobytes(), lambda: Handles(surface.lse, moving, run))
    polish = None
    if options.polish and len(moving):
        polish = surface.polish.get(
            moving.tobytes(), lambda: Polish(surface.lse, surface.rings, moving)
        )
    return PreparedEdit(mesh, surface, handles, polish, twins, options)


def _level_surface(
    mesh: Mesh,
    roi: I64,
    level: float,
    options: EditOptions,
    run: Run,
    decomposition: Decomposition | None,
) -> LevelSurface:
    region_key = (mesh.digest, roi.tobytes(), options.rim, options.free_borders)
    parts = decomposition
    if parts is None or not _is_of(parts, mesh, roi, options) or not parts.reaches(level):
        parts = run.memo.get(
            ("decomposition", *region_key, level),
            lambda: _decomposed(mesh, roi, level, options, run),
        )
    k = parts.mode_count(level)
    # Factors are large: of these only the newest are kept.
    surfaces: Memo = run.memo.get("level surfaces", lambda: Memo(2))

    def at_level() -> LevelSurface:
        run.tick(0.0, "Preparing the surface")
        return while_polling(run, lambda: LevelSurface(parts, k))

    return surfaces.get((*region_key, k), at_level)


def _pins(options: EditOptions) -> I64:
    return np.unique(np.array(options.pins, dtype=np.int64))


def _is_of(parts: Decomposition, mesh: Mesh, roi: I64, options: EditOptions) -> bool:
    region = parts.region
    chosen = np.concatenate([region.roi, region.held, region.unused])
    return (
        region.mesh is mesh
        and parts.rim == options.rim
        and region.free_borders == options.free_borders
        and np.array_equal(np.sort(chosen), np.unique(roi))
    )


def _decomposed(
    mesh: Mesh, roi: I64, level: float, options: EditOptions, run: Run
) -> Decomposition:
    for parts in decompose_stream(mesh, roi, None, options.rim, run, options.free_borders):
        if parts.reaches(level):
            break
    return parts


class LevelSurface:
    """A region's surface at k modes, ready to be deformed and to get its details back.

    Parameters
    ----------
    decomposition : the region taken apart.
    k : number of modes that stay in.
    """

    def __init__(self, decomposition: Decomposition, k: int) -> None:
        self.decomposition = decomposition
        self.k = k
        region = decomposition.region
        self.rest: F64 = decomposition.surface(k)
        self.lse = Lse(region, (self.rest - region.centre) / region.scale)
        self.high: F64 = decomposition.high(k)
        self.rings = ring_products(
            self.lse.positions, self.lse.stiffness, np.arange(decomposition.m)
        )
        self.handles = Memo(1)
        self.polish = Memo(1)


class PreparedEdit:
    """All of an edit that does not depend on its targets.

    Attributes
    ----------
    decomposition : the region taken apart.
    k : number of modes at the edit's level.
    """

    def __init__(
        self,
        mesh: Mesh,
        surface: LevelSurface,
        handles: Handles,
        polish: Polish | None,
        twins: Twins | None,
        options: EditOptions,
    ) -> None:
        self._mesh = mesh
        self._surface = surface
        self._handles = handles
        self._polish = polish
        self._twins = twins
        self._options = options
        self.decomposition = surface.decomposition
        self.k = surface.k
        self._scale = surface.decomposition.region.scale

    def solve(self, strokes: Sequence[Stroke]) -> EditResult:
        """Return the surface for these targets.

        Parameters
        ----------
        strokes : with the anchors that were prepared; views and targets are free.

        Raises
        ------
        SolveError
            The deformed surface is not finite or runs away.
        SketchError
            A target lies behind the eye.
        """
        rest = self._surface.rest
        asked = strokes
        if self._twins is not None:
            asked = self._twins.with_twins(strokes, self._placed(rest))
        aims = Rows.stacked([self._pin_rows(), *(self._sight_rows(s) for s in asked)])
        rows = Rows.stacked([aims.agreed(), *(self._depth_rows(s) for s in asked)])
        moved = self._handles.displacement(rows)
        if not moved.any():
            level = self._placed(rest)
            return self._result(level, self._mesh.vertices, strokes)
        if self._polish is not None:
            moved = self._polish.relax(moved, self._options.polish)
        self._guard(moved, rows)
        deformed = rest + moved * self._scale
        detailed = self.detailed(moved)
        level = self._placed(deformed)
        return self._result(level, self._placed(detailed), strokes)

    def _result(self, level: F64, vertices: F64, strokes: Sequence[Stroke]) -> EditResult:
        error = self._target_error(level, strokes)
        return EditResult(level, vertices, error, self._mesh, self.decomposition.roi)

    def _placed(self, positions: F64) -> F64:
        """Return positions (m, 3) of the region with everything else as it is, (n, 3)."""
        x = self._mesh.vertices.copy()
        x[self.decomposition.roi] = positions
        return x

    def detailed(self, moved: F64) -> F64:
        """Return the original plus what moved plus what the turn of the details adds (Eq. 20).

        x' + L^-1 (R delta_high) = x + (x' - x_level) + L^-1 ((R - 1) delta_high), in the form that
        returns the original to the bit where nothing moves.

        Parameters
        ----------
        moved : (m, 3) displacement of the surface at the level, in the region's frame.
        """
        parts = self.decomposition
        shifted = parts.original + moved * self._scale
        if not self._options.rectify or self.k >= parts.m:
            return shifted
        high = self._surface.high
        return parts.reconstruct(shifted, turned(self.rotations(moved), high) - high)

    def rotations(self, moved: F64) -> F64:
        """Return the local rotations (m, 3, 3) of a displacement (m, 3) in the region's frame."""
        x = self._surface.lse.positions.copy()
        x[: len(moved)] += moved
        return ring_rotations(self._surface.rings, x)

    def _guard(self, moved: F64, rows: Rows) -> None:
        """Refuse a surface that runs further than what was drawn explains.

        A prototype's "no further than a diagonal" would refuse a target drawn far away on purpose,
        so the limit grows with the longest way that an anchor was asked to go.
        """
        farthest = float(np.linalg.norm(moved, axis=1).max())
        asked = float(np.abs(rows.distances).max(initial=0.0))
        if not farthest <= _FARTHEST + 4.0 * asked:
            raise SolveError(
                "The surface runs away from what was drawn. "
                "Draw the target closer to the form, or raise the depth hold."
            )

    def _sight_rows(self, stroke: Stroke) -> Rows:
        """Return the rows of Eq. 17 for one stroke, in the region's frame.

        Two planes contain the line of sight of a target pixel (u, v): (P1 - u P3) x = 0 and
        (P2 - v P3) x = 0, exact in perspective. Each is divided by the length of its normal, so
        that it measures a distance.
        """
        inside, which = self._moving(stroke.anchors)
        x = self._surface.rest[np.searchsorted(self.decomposition.roi, stroke.anchors[inside])]
        if not (stroke.view.depth(x) > 0).all():
            raise SketchError(
                "A part of the source curve lies behind the camera. Draw it in front of the camera."
            )
        here = stroke.view.project(x)
        way = self._options.amount * (stroke.target[inside] - here)
        still = np.linalg.norm(way, axis=1) <= _STILL_PX
        uv = here + way
        P = stroke.view.pixel_matrix
        planes = P[None, :2] - uv[:, :, None] * P[2]
        size = np.linalg.norm(planes[:, :, :3], axis=2)
        if not (size > 0).all():
            raise SketchError("A target lies behind the eye. Draw it in front of the camera.")
        homogeneous = np.column_stack([x, np.ones(len(x))])
        away = np.einsum("cra,ca->cr", planes, homogeneous) / size / self._scale
        away[still] = 0.0
        weights = np.ones(len(x)) if stroke.weights is None else stroke.weights[inside]
        return Rows(
            np.repeat(which, 2),
            (planes[:, :, :3] / size[:, :, None]).reshape(-1, 3),
            -away.ravel(),
            np.repeat(1.0 / weights - 1.0, 2),
        )

    def _depth_rows(self, stroke: Stroke) -> Rows:
        """Return the weak rows that hold the anchors' distance from the eye."""
        hold = self._options.depth_hold
        _, which = self._moving(stroke.anchors)
        if hold <= 0:
            which = which[:0]
        c = len(which)
        direction = np.broadcast_to(sight_direction(stroke.view), (c, 3))
        return Rows(which, direction, np.zeros(c), np.full(c, 1.0 / max(hold, 1e-300)))

    def _moving(self, ids: I64) -> tuple[B1, I64]:
        """Return which vertices can move, and their places in the list of anchors."""
        roi = self.decomposition.roi
        inside = np.isin(ids, roi)
        return inside, np.searchsorted(self._handles.anchors, np.searchsorted(roi, ids[inside]))

    def _pin_rows(self) -> Rows:
        pins = _pins(self._options)
        if self._twins is not None and len(pins):
            pins = np.union1d(pins, self._twins.of(pins))
        _, which = self._moving(pins)
        c = len(which)
        return Rows(
            np.repeat(which, 3), np.tile(np.eye(3), (c, 1)), np.zeros(3 * c), np.zeros(3 * c)
        )

    def _target_error(self, level: F64, strokes: Sequence[Stroke]) -> float:
        worst = 0.0
        for stroke in strokes:
            rest = self._placed(self._surface.rest)[stroke.anchors]
            here = stroke.view.project(rest)
            wanted = here + self._options.amount * (stroke.target - here)
            seen = stroke.view.project(level[stroke.anchors])
            away = np.linalg.norm(seen - wanted, axis=1)
            worst = max(worst, float(away.max(initial=0.0)))
        return worst


def sight_direction(view: View) -> F64:
    """Return the unit direction that the middle of the viewport looks along, (3,).

    It is where the two sight planes of the middle pixel meet, which holds for parallel projections
    as for perspective ones.
    """
    P = view.pixel_matrix
    u, v = view.size[0] / 2, view.size[1] / 2
    along = np.cross((P[0] - u * P[2])[:3], (P[1] - v * P[2])[:3])
    size = float(np.linalg.norm(along))
    if not size > 0:
        raise SketchError("The view has no depth. Draw the stroke again in another view.")
    return np.asarray(along / size)
