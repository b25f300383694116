"""Put a recipe made on one mesh onto another with other triangles."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, replace
from typing import Any, get_type_hints

import numpy as np
from scipy.spatial import cKDTree

from engine.align import Alignment, align
from engine.applied import applied
from engine.arrays import F64, I64, frozen
from engine.curves import positions_along, values_along
from engine.data_step import DataStep
from engine.edit import SketchEdit, Stroke
from engine.errors import RecipeError
from engine.mesh import Mesh
from engine.mirror import mirrored_region
from engine.recipe import Recipe, Step, UnknownStep
from engine.run import Run
from engine.view import View

# What is further from the other surface than this share of the diagonal has no counterpart.
_FAR = 0.03


@dataclass(frozen=True)
class TransferReport:
    """How well a recipe fits the mesh that it was put on.

    Parameters
    ----------
    scale : how much larger the new mesh is.
    rms, farthest : distance between the two surfaces after alignment, over all vertices of the
        regions and anchors, in units of the new mesh.
    lost_vertices : share of the regions' vertices without a counterpart on the new mesh.
    lost_anchors : share of the anchors without one.
    """

    scale: float
    rms: float
    farthest: float
    lost_vertices: float
    lost_anchors: float

    def lines(self) -> list[str]:
        """Return the report in plain words."""
        told = [
            f"The new mesh is {self.scale:.4g} times the size of the old one.",
            f"The surfaces are {self.rms:.3g} apart on average, {self.farthest:.3g} at most.",
        ]
        if self.lost_vertices > 0:
            told.append(f"{self.lost_vertices:.1%} of the regions have no counterpart.")
        if self.lost_anchors > 0:
            told.append(f"{self.lost_anchors:.1%} of the anchors have no counterpart.")
        return told

    def __str__(self) -> str:
        return " ".join(self.lines())


@dataclass(frozen=True, eq=False)
class Transferred:
    """A recipe for another mesh, and how well it fits."""

    recipe: Recipe
    report: TransferReport


def transfer(
    recipe: Recipe,
    mesh: Mesh,
    other: Mesh,
    alignment: Alignment | None = None,
    run: Run | None = None,
) -> Transferred:
    """Return a recipe that does on `other` what `recipe` does on `mesh`.

    Both meshes go through the recipe together, so each step is carried over between the shapes
    that it meets: a region becomes the vertices nearest to it, a chain of anchors the vertices
    nearest to its curve, each going the same way in the same view as the place on the curve that
    it stands for. The view is moved with the alignment.

    Parameters
    ----------
    recipe : made on `mesh`.
    mesh, other : the two surfaces.
    alignment : takes `other` to the frame of `mesh`; None to find it.
    run : progress and cancel.

    Raises
    ------
    RecipeError
        A region or a curve has no counterpart, or a step cannot be carried over.
    """
    run = run or Run()
    digest = other.digest if recipe.digest else ""
    alignment = alignment or align(other, mesh)
    steps: list[Step] = []
    fits: list[_Fit] = []
    for i, step in enumerate(recipe.steps):
        run.tick(i / len(recipe.steps), "Transferring")
        pair = _Pair(mesh, other, alignment)
        carried = pair.step(step, run)
        steps.append(carried)
        fits.append(pair.fit)
        if i not in recipe.muted:
            mesh, other = applied(step, mesh, run), applied(carried, other, run)
    carried_recipe = replace(recipe, steps=tuple(steps), digest=digest)
    return Transferred(carried_recipe, _report(fits, alignment))


class _Fit:
    """Distances of what was carried over, in units of the old mesh."""

    def __init__(self) -> None:
        self.distances: list[F64] = [np.zeros(0)]
        self.vertices = self.lost_vertices = self.anchors = self.lost_anchors = 0


def _report(fits: list[_Fit], alignment: Alignment) -> TransferReport:
    away = np.concatenate([np.zeros(0), *(d for fit in fits for d in fit.distances)])
    away = away / alignment.scale
    vertices, anchors = sum(f.vertices for f in fits), sum(f.anchors for f in fits)
    return TransferReport(
        scale=1 / alignment.scale,
        rms=float(np.sqrt((away**2).mean())) if len(away) else 0.0,
        farthest=float(away.max(initial=0.0)),
        lost_vertices=sum(f.lost_vertices for f in fits) / max(vertices, 1),
        lost_anchors=sum(f.lost_anchors for f in fits) / max(anchors, 1),
    )


class _Pair:
    """Two surfaces in one frame, and the carrying over of what refers to the first one."""

    def __init__(self, mesh: Mesh, other: Mesh, alignment: Alignment) -> None:
        self._mesh = mesh
        self._other = other
        self._alignment = alignment
        self._placed = alignment.moved(other.vertices)
        self._far = _FAR * mesh.diagonal
        self._tree = cKDTree(self._placed)
        self.fit = _Fit()

    def step(self, step: Step, run: Run) -> Step:
        """Return a step carried over."""
        if isinstance(step, SketchEdit):
            return self._sketch(step, run)
        if isinstance(step, DataStep):
            return self._data_step(step)
        if isinstance(step, UnknownStep):
            raise RecipeError(
                f"A step of the kind “{step.name}” cannot be carried over without its plugin. "
                "Install the plugin, or take the step out."
            )
        return step

    def _data_step(self, step: DataStep) -> Step:
        hints = get_type_hints(type(step))
        changes: dict[str, Any] = {
            field.name: self._region(getattr(step, field.name))
            for field in dataclasses.fields(step)
            if hints[field.name] == I64
        }
        return replace(step, **changes)

    def _region(self, roi: I64) -> I64:
        """Return the vertices of the other mesh whose nearest vertex of this one is in `roi`."""
        roi = np.asarray(roi, dtype=np.int64)
        if len(roi) == 0:
            return roi
        away, nearest = cKDTree(self._mesh.vertices).query(self._placed)
        found = np.flatnonzero(np.isin(nearest, roi) & (away <= self._far))
        back = self._tree.query(self._mesh.vertices[roi])[0]
        lost = int((back > self._far).sum())
        self.fit.vertices += len(roi)
        self.fit.lost_vertices += lost
        if len(found) == 0 or lost > len(roi) / 2:
            raise RecipeError(
                "The region has no counterpart on the new mesh. "
                "Check that it is the same form, or give the alignment."
            )
        self.fit.distances.append(away[found])
        ids: I64 = frozen(found, np.int64)
        return ids

    def _ids(self, ids: I64, among: I64) -> I64:
        """Return the vertices of `among` nearest to given ones, in order, each once."""
        x = self._mesh.vertices[ids]
        away, nearest = cKDTree(self._placed[among]).query(x)
        near = away <= self._far
        self.fit.anchors += len(ids)
        self.fit.lost_anchors += int((~near).sum())
        found = among[nearest[near]]
        return np.asarray(found[np.sort(np.unique(found, return_index=True)[1])])

    def _sketch(self, edit: SketchEdit, run: Run) -> SketchEdit:
        roi = self._region(np.asarray(edit.roi))
        there = self._pins(edit, roi)
        if len(edit.options.mirror):
            edit = replace(edit, options=replace(edit.options, mirror=self._plane(edit)))
        bare = SketchEdit(roi, edit.level, (), replace(edit.options, pins=there))
        if not edit.strokes:
            return bare
        before = self._rest(replace(edit, strokes=()), self._mesh, run)
        after = self._rest(bare, self._other, run)
        strokes = tuple(self._stroke(stroke, roi, before, after) for stroke in edit.strokes)
        return replace(bare, strokes=strokes)

    def _pins(self, edit: SketchEdit, roi: I64) -> tuple[int, ...]:
        """Carry the pins over to `roi`; those outside the edit's region hold nothing, and go."""
        inside = np.asarray(edit.roi)
        if len(edit.options.mirror):
            inside = mirrored_region(self._mesh, inside, edit.options.mirror)
            roi = mirrored_region(self._other, roi, self._plane(edit))
        pins = np.intersect1d(np.array(edit.options.pins, dtype=np.int64), inside)
        return tuple(self._ids(pins, roi).tolist()) if len(pins) else ()

    def _plane(self, edit: SketchEdit) -> tuple[float, ...]:
        """Return the mirror plane in the frame of the other mesh: n . (A x + t) = d."""
        normal, d = np.array(edit.options.mirror[:3]), edit.options.mirror[3]
        A, t = self._alignment.matrix[:3, :3], self._alignment.matrix[:3, 3]
        return (*(A.T @ normal).tolist(), float(d - normal @ t))

    @staticmethod
    def _rest(edit: SketchEdit, mesh: Mesh, run: Run) -> F64:
        """Return the surface that the strokes of an edit deform, (n, 3)."""
        return edit.prepare(mesh, run).solve(()).level_vertices

    def _stroke(self, stroke: Stroke, roi: I64, before: F64, after: F64) -> Stroke:
        """Carry a stroke over, from the surface `before` to the surface `after` (n, 3)."""
        curve = self._mesh.vertices[stroke.anchors]
        # Finer meshes get more anchors, so the curve is walked at a fraction of its own steps.
        steps = np.linspace(0, len(curve) - 1 + stroke.closed, 8 * len(curve))
        walked = values_along(curve, np.minimum(steps, len(curve) - 1e-9), stroke.closed)
        away, nearest = cKDTree(self._placed[roi]).query(walked)
        near = away <= self._far
        found = roi[nearest[near]]
        anchors = found[np.sort(np.unique(found, return_index=True)[1])]
        self.fit.anchors += len(walked)
        self.fit.lost_anchors += int((~near).sum())
        if len(anchors) == 0:
            raise RecipeError(
                "A source curve has no counterpart on the new mesh. "
                "Check that it is the same form, or give the alignment."
            )
        self.fit.distances.append(away[near])
        at = positions_along(curve, self._placed[anchors], stroke.closed)
        way = stroke.target - stroke.view.project(before[stroke.anchors])
        view = View(stroke.view.matrix @ self._alignment.matrix, stroke.view.size)
        target = view.project(after[anchors]) + values_along(way, at, stroke.closed)
        weights = stroke.weights
        if weights is not None:
            weights = values_along(weights[:, None], at, stroke.closed)[:, 0]
        return Stroke(anchors, view, target, stroke.closed, weights, outline=stroke.outline)
