"""An edit prepared: all that does not depend on its targets, and the way from targets on."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from engine.arap import Polish
from engine.arrays import B1, F64, I64
from engine.contour import Contour, OutlineAim, contour_beside
from engine.decomposition import decompose_stream
from engine.detail import Decomposition
from engine.details import Details
from engine.errors import SketchError, SolveError
from engine.handles import Handles, Rows
from engine.lse import Lse
from engine.mesh import Mesh
from engine.mirror import Twins, mirrored_region
from engine.outlines import Outlines
from engine.rectify import ring_products, ring_rotations
from engine.result import EditResult, LevelResult
from engine.run import Memo, Run
from engine.sight import depth_rows, seen, sight_rows
from engine.threads import while_polling

if TYPE_CHECKING:
    from engine.edit import EditOptions, Stroke

# How far a vertex may go beyond what was drawn, in diagonals of the region.
_FARTHEST = 1.0


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
    mesh : the mesh.
    roi : (m,) vertex ids of the region.
    level : 0..1, at which the strokes deform the surface.
    anchors : (c,) vertex ids of each stroke; none prepares what the anchors do not change.
    options : how it is deformed.
    run : progress, cancel and memo.
    decomposition : of the same mesh, region and rim rule, to compute no modes again; None to make
        one with the modes that the level needs.
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
        with ThreadPoolExecutor(1, thread_name_prefix="engine") as beside:
            details = beside.submit(Details, decomposition, k)
            self.lse = Lse(region, (self.rest - region.centre) / region.scale)
            self.details = details.result()
        self.rings = ring_products(self.lse.positions, self.lse.stiffness, self.details.rows)
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
        self._rest = self._placed(surface.rest)
        # What strokes need to know, by their anchors: it takes longer to find than to move them.
        self._places = Memo(32)
        self._contours = Memo(8)

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
        moved = self._moved(strokes)
        if not moved.any():
            error = self._target_error(self._rest, strokes)
            return self._result(self._rest.copy(), self._mesh.vertices, error)
        moved, error = self._onto_outlines(moved, strokes)
        detailed = self.detailed(moved)
        return self._result(self._level(moved), self._placed(detailed), error)

    def follow(self, strokes: Sequence[Stroke]) -> LevelResult:
        """Return the surface at the level for targets that are still on their way.

        Anchors meet their targets as in `solve`. Outlines come nearer by one round, which is most
        of the way, and details stay off: for these `solve` takes up to ten times as long.

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
        moved = self._moved(strokes)
        if moved.any():
            moved, error = self._onto_outlines(moved, strokes, coarse=True)
        else:
            error = self._target_error(self._rest, strokes)
        return LevelResult(self._level(moved), error, self._mesh, self.decomposition.roi)

    def _moved(self, strokes: Sequence[Stroke]) -> F64:
        """Return the displacement (m, 3) that brings anchors to targets, in the region's frame."""
        rows = self._rows(strokes)
        moved = self._handles.displacement(rows)
        if self._polish is not None and moved.any():
            moved = self._polish.relax(moved, self._options.polish)
        self._guard(moved, rows)
        return moved

    def _rows(self, strokes: Sequence[Stroke]) -> Rows:
        """Return all that strokes and pins ask for."""
        asked = strokes
        if self._twins is not None:
            asked = self._twins.with_twins(strokes, self._rest)
        aims = Rows.stacked([self._pin_rows(), *(self._sight_rows(s) for s in asked)])
        return Rows.stacked([aims.agreed(), *(self._depth_rows(s) for s in asked)])

    def _onto_outlines(
        self, moved: F64, strokes: Sequence[Stroke], coarse: bool = False
    ) -> tuple[F64, float]:
        """Move on until outlines lie on their targets; return the displacement and what is left.

        Anchors on an outline stay inside their targets by as much as the outline goes beyond.
        """
        amount, roi = self._options.amount, self.decomposition.roi
        aims = {
            i: OutlineAim(self._contour_at(stroke.anchors), self._mesh, self._rest, stroke, amount)
            for i, stroke in enumerate(strokes)
            if stroke.outline
        }
        others = [stroke for i, stroke in enumerate(strokes) if i not in aims]
        if not aims:
            return moved, self._target_error(self._level(moved), others)

        def answer(further: Sequence[Stroke]) -> tuple[F64, F64] | None:
            try:
                found = self._moved(further)
            except SolveError:
                return None
            return found, self._level(found)

        def ways(further: list[list[Stroke]]) -> F64:
            # Before the polish, displacements are linear in the targets.
            start = self._handles.displacement(self._rows(strokes))
            found = [self._handles.displacement(self._rows(each)) - start for each in further]
            return np.array(found) * self._scale

        outlines = Outlines(aims, strokes, answer, ways, roi)
        bring = outlines.nearer if coarse else outlines.met
        nearest, off = bring(moved, self._level(moved))
        return nearest, max(self._target_error(self._level(nearest), others), off)

    def _contour_at(self, anchors: I64) -> Contour:
        roi, rest = self.decomposition.roi, self._rest
        return self._contours.get(
            anchors.tobytes(), lambda: contour_beside(self._mesh, roi, rest, anchors)
        )

    def _level(self, moved: F64) -> F64:
        """Return the surface at the level after a displacement (m, 3) in its frame, (n, 3)."""
        return self._placed(self._surface.rest + moved * self._scale)

    def _result(self, level: F64, vertices: F64, error: float) -> EditResult:
        return EditResult(level, error, self._mesh, self.decomposition.roi, vertices)

    def _placed(self, positions: F64) -> F64:
        """Return positions (m, 3) of the region with everything else as it is, (n, 3)."""
        x = self._mesh.vertices.copy()
        x[self.decomposition.roi] = positions
        return x

    def detailed(self, moved: F64) -> F64:
        """Return the original plus what moved plus what the turn of the details adds (Eq. 20).

        x' + L^-1 (R delta_high) = x + (x' - x_level) + L^-1 ((R - 1) delta_high), in the form that
        returns the original to the bit where nothing moves; see `Details` for L^-1.

        Parameters
        ----------
        moved : (m, 3) displacement of the surface at the level, in the region's frame.
        """
        parts = self.decomposition
        shifted = parts.original + moved * self._scale
        if not self._options.rectify or self.k >= parts.m:
            return shifted
        x = self._surface.lse.positions.copy()
        x[: len(moved)] += moved
        R = ring_rotations(self._surface.rings, x)
        return shifted + self._surface.details.turning(R)

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
        """Return the rows of Eq. 17 for one stroke, `amount` of the way to its target."""
        inside, which = self._moving(stroke.anchors)
        x = self._rest[stroke.anchors[inside]]
        way = self._options.amount * (stroke.target[inside] - seen(stroke.view, x))
        weights = np.ones(len(x)) if stroke.weights is None else stroke.weights[inside]
        return sight_rows(stroke.view, x, way, self._scale, which, weights)

    def _depth_rows(self, stroke: Stroke) -> Rows:
        """Return the weak rows that hold the anchors' distance from the eye."""
        return depth_rows(stroke.view, self._moving(stroke.anchors)[1], self._options.depth_hold)

    def _moving(self, ids: I64) -> tuple[B1, I64]:
        """Return which vertices can move, and their places in the list of anchors."""
        return self._places.get(ids.tobytes(), lambda: self._found(ids))

    def _found(self, ids: I64) -> tuple[B1, I64]:
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
            here = stroke.view.project(self._rest[stroke.anchors])
            wanted = here + self._options.amount * (stroke.target - here)
            seen = stroke.view.project(level[stroke.anchors])
            away = np.linalg.norm(seen - wanted, axis=1)
            worst = max(worst, float(away.max(initial=0.0)))
        return worst
