"""An edit prepared: all that does not depend on its targets, and the way from targets on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from engine.arap import Polish
from engine.arrays import F64, I64
from engine.decomposition import decompose_stream
from engine.detail import Decomposition
from engine.errors import SketchError, SolveError
from engine.handles import Handles, Rows
from engine.lse import Lse
from engine.mesh import Mesh
from engine.rectify import ring_products, ring_rotations, turned
from engine.run import Memo, Run
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
    target_error_px : largest distance of a reprojected anchor from its target, px.
    """

    level_vertices: F64
    vertices: F64
    target_error_px: float


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
    region_key = (mesh.digest, roi.tobytes(), options.rim, options.free_borders)
    parts = decomposition
    if parts is None or not _is_of(parts, mesh, options) or not parts.reaches(level):
        parts = run.memo.get(
            ("decomposition", *region_key, level),
            lambda: _decomposed(mesh, roi, level, options, run),
        )
    k = parts.mode_count(level)
    # Factors are large: of these only the newest are kept.
    surfaces: Memo = run.memo.get("level surfaces", lambda: Memo(2))

    def at_level() -> LevelSurface:
        run.tick(0.0, "Preparing the surface")
        return LevelSurface(parts, k)

    surface = surfaces.get((*region_key, k), at_level)
    ids = np.concatenate([*anchors, np.array(options.pins, dtype=np.int64)]).astype(np.int64)
    moving = np.unique(np.searchsorted(parts.roi, ids[np.isin(ids, parts.roi)]))
    if len(anchors) and len(moving) == 0:
        raise SketchError(
            "No anchor of the strokes can move: they lie outside the region or on an open border. "
            "Draw the source curve inside the region."
        )

    def at_anchors() -> Handles:
        run.tick(0.5, "Preparing the anchors")
        return Handles(surface.lse, moving, run)

    handles = surface.handles.get(moving.tobytes(), at_anchors)
    polish = None
    if options.polish and len(moving):
        polish = surface.polish.get(
            moving.tobytes(), lambda: Polish(surface.lse, surface.rings, moving)
        )
    return PreparedEdit(mesh, surface, handles, polish, options)


def _is_of(parts: Decomposition, mesh: Mesh, options: EditOptions) -> bool:
    region = parts.region
    return (
        region.mesh is mesh
        and parts.rim == options.rim
        and region.free_borders == options.free_borders
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
        options: EditOptions,
    ) -> None:
        self._mesh = mesh
        self._surface = surface
        self._handles = handles
        self._polish = polish
        self._options = options
        self.decomposition = surface.decomposition
        self.k = surface.k

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
        region = self.decomposition.region
        rest = self._surface.rest
        parts = [self._stroke_rows(stroke) for stroke in strokes]
        parts.append(self._pin_rows())
        rows = Rows.stacked(parts)
        moved = self._handles.displacement(rows)
        if not moved.any():
            level = self._placed(rest)
            return EditResult(level, self._mesh.vertices, self._target_error(level, strokes))
        if self._polish is not None:
            moved = self._polish.relax(moved, self._options.polish)
        self._guard(moved, rows)
        deformed = rest + moved * region.scale
        detailed = self.detailed(moved)
        level = self._placed(deformed)
        return EditResult(level, self._placed(detailed), self._target_error(level, strokes))

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
        shifted = parts.original + moved * parts.region.scale
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

    def _stroke_rows(self, stroke: Stroke) -> Rows:
        """Return the rows of Eq. 17 for one stroke, in the region's frame.

        Two planes contain the line of sight of a target pixel (u, v): (P1 - u P3) x = 0 and
        (P2 - v P3) x = 0, exact in perspective. Each is divided by the length of its normal, so
        that it measures a distance. A third, weak row holds the depth.
        """
        region, roi = self.decomposition.region, self.decomposition.roi
        inside = np.isin(stroke.anchors, roi)
        ids = np.searchsorted(roi, stroke.anchors[inside])
        which = np.searchsorted(self._handles.anchors, ids)
        x = self._surface.rest[ids]
        here = stroke.view.project(x)
        way = self._options.amount * (stroke.target[inside] - here)
        still = np.linalg.norm(way, axis=1) <= _STILL_PX
        uv = here + way
        P = stroke.view.pixel_matrix
        homogeneous = np.column_stack([x, np.ones(len(x))])
        normals, distances = [], []
        for axis in (0, 1):
            plane = P[axis] - uv[:, axis, None] * P[2]
            size = np.linalg.norm(plane[:, :3], axis=1)
            if not (size > 0).all():
                raise SketchError("A target lies behind the eye. Draw it in front of the camera.")
            normals.append(plane[:, :3] / size[:, None])
            away = np.einsum("ca,ca->c", plane, homogeneous) / size / region.scale
            distances.append(np.where(still, 0.0, -away))
        weights = np.ones(len(ids)) if stroke.weights is None else stroke.weights[inside]
        give = 1.0 / weights - 1.0
        hold = self._options.depth_hold
        if hold > 0:
            normals.append(np.broadcast_to(sight_direction(stroke.view), (len(ids), 3)))
            distances.append(np.zeros(len(ids)))
        softness = [give, give] + ([np.full(len(ids), 1.0 / hold)] if hold > 0 else [])
        return Rows(
            np.tile(which, len(normals)),
            np.concatenate(normals),
            np.concatenate(distances),
            np.concatenate(softness),
        )

    def _pin_rows(self) -> Rows:
        roi = self.decomposition.roi
        pins = np.unique(np.array(self._options.pins, dtype=np.int64))
        ids = np.searchsorted(roi, pins[np.isin(pins, roi)])
        which = np.searchsorted(self._handles.anchors, ids)
        return Rows(
            np.repeat(which, 3),
            np.tile(np.eye(3), (len(ids), 1)),
            np.zeros(3 * len(ids)),
            np.zeros(3 * len(ids)),
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
