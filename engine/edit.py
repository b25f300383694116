"""SketchEdit: steps 2 to 7 of Section 5.2 as one replayable step."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from engine.arrays import F64, I64, frozen
from engine.data_step import ids_from_text, ids_to_text
from engine.detail import Decomposition
from engine.errors import RecipeError, SketchError
from engine.mesh import Mesh
from engine.prepared import PreparedEdit, prepare_edit
from engine.run import Run
from engine.view import View

FARTHEST_TARGET_PX = 1e6
"""A target further from the viewport's corner than this is a slip, not a wish."""


@dataclass(frozen=True, eq=False)
class Source:
    """A source curve on the surface: its anchor vertices in order and the view it was drawn in.

    Parameters
    ----------
    anchors : (c,) int64 vertex ids, each once.
    view : the camera it was drawn through.
    closed : whether the last anchor is followed by the first.
    weights : (c,) in (0, 1], how firmly each anchor shall meet its target; None for all 1.
    outline : whether the anchors lie on the outline of the form in this view.
    """

    anchors: I64
    view: View
    closed: bool = False
    weights: F64 | None = None
    outline: bool = False

    def still(self, mesh: Mesh) -> Stroke:
        """Return the stroke whose target is where `mesh` shows the anchors: it moves nothing."""
        here = self.view.project(mesh.vertices[self.anchors])
        return Stroke(self.anchors, self.view, here, self.closed, self.weights)


@dataclass(frozen=True, eq=False)
class Stroke:
    """A source curve and where it shall go: target (c, 2) px in `view`, one row an anchor.

    Parameters
    ----------
    anchors : (c,) int64 vertex ids, each once.
    view : the camera that the target was drawn through.
    target : (c, 2) float64 px, where each anchor shall be seen.
    closed : whether the last anchor is followed by the first.
    weights : (c,) in (0, 1], how firmly each anchor shall meet its target; None for all 1.
    hidden : whether it is put aside in a draft: it stays there and has no effect.
    outline : whether the outline of the form, in this view, shall meet the target rather than the
        anchors, which lie on the outline before.
    """

    anchors: I64
    view: View
    target: F64
    closed: bool = False
    weights: F64 | None = None
    hidden: bool = False
    outline: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return plain lists and numbers."""
        data: dict[str, Any] = {
            "anchors": np.asarray(self.anchors).tolist(),
            "view": self.view.to_json(),
            "target": np.asarray(self.target).tolist(),
        }
        for name in ("closed", "outline"):
            if getattr(self, name):
                data[name] = True
        if self.weights is not None:
            data["weights"] = np.asarray(self.weights).tolist()
        return data

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Build a stroke from what `to_json` gave.

        Raises
        ------
        RecipeError
            Something is missing, of another shape, or not a sensible number.
        """
        if not isinstance(data, dict):
            raise RecipeError("A stroke must be an object with anchors, view and target.")
        known = {f.name for f in fields(cls)} - {"hidden"}
        _refuse_unknown(data, known, "A stroke")
        if not {"anchors", "view", "target"} <= set(data):
            raise RecipeError("A stroke lacks its anchors, its view or its target. Add them.")
        closed, outline = data.get("closed", False), data.get("outline", False)
        for name, value in (("closed", closed), ("outline", outline)):
            if not isinstance(value, bool):
                raise RecipeError(f"A stroke's “{name}” must be true or false.")
        weights = data.get("weights")
        try:
            view = View.from_json(data["view"])
        except (KeyError, TypeError, ValueError, OverflowError, SketchError) as error:
            raise RecipeError(
                "A stroke's view cannot be read. It needs a matrix of 4 by 4 numbers and a size."
            ) from error
        stroke = cls(
            _numbers(data["anchors"], np.int64, "A stroke's anchors", 1),
            view,
            _numbers(data["target"], np.float64, "A stroke's target", 2),
            closed,
            None if weights is None else _numbers(weights, np.float64, "A stroke's weights", 1),
            outline=outline,
        )
        check_stroke(stroke)
        return stroke


@dataclass(frozen=True)
class EditOptions:
    """How an edit is solved.

    Parameters
    ----------
    rim : how the base meets what stays: "smooth" (two rings of positions) or "paper" (Eq. 10).
    rectify : turn the details with the surface (Eqs. 18 to 20); off shows what it is for (Fig. 11).
    depth_hold : how firmly the anchors keep their distance from the eye, in units of the surface's
        own stiffness: 0 leaves it to the surface, 10 nearly fixes it.
    amount : share of the way to the target, 0 to 1.5.
    polish : rounds of as-rigid-as-possible relaxation after the solve; 0 is the paper's result.
    pins : vertex ids that stay where they are.
    mirror : plane a, b, c, d (a x + b y + c z = d) that the edit is mirrored across, or ().
    free_borders : let the open borders inside the region move too.
    """

    rim: Literal["smooth", "paper"] = "smooth"
    rectify: bool = True
    depth_hold: float = 0.02
    amount: float = 1.0
    polish: int = 0
    pins: tuple[int, ...] = ()
    mirror: tuple[float, ...] = ()
    free_borders: bool = False

    def __post_init__(self) -> None:
        # Lists from a script become tuples, so that options stay hashable.
        object.__setattr__(self, "pins", tuple(self.pins))
        object.__setattr__(self, "mirror", tuple(self.mirror))

    def to_json(self) -> dict[str, Any]:
        """Return the options that differ from the defaults."""
        standard = EditOptions()
        data = {
            f.name: getattr(self, f.name)
            for f in fields(self)
            if getattr(self, f.name) != getattr(standard, f.name)
        }
        return {k: list(v) if isinstance(v, tuple) else v for k, v in data.items()}

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Build options from what `to_json` gave; what is absent has its default.

        Raises
        ------
        RecipeError
            An option is unknown, of another type, or outside its limits.
        """
        if not isinstance(data, dict):
            raise RecipeError("The options of a sketch must be an object.")
        _refuse_unknown(data, {f.name for f in fields(cls)}, "The options of a sketch")
        values = dict(data)
        for name in ("pins", "mirror"):
            if name in values:
                kind = np.int64 if name == "pins" else np.float64
                values[name] = tuple(_numbers(values[name], kind, f"“{name}”", 1).tolist())
        options = cls(**values)
        check_options(options)
        return options


@dataclass(frozen=True, eq=False)
class SketchEdit:
    """Reshape `roi` at `level` so that the strokes' anchors meet their targets.

    Parameters
    ----------
    roi : (m,) int64 ascending vertex ids of the region.
    level : level of detail in 0..1 (Eq. 16); what is finer is taken off and put back afterwards.
    strokes : source curves with their targets, solved together.
    options : how it is solved.
    """

    roi: I64
    level: float
    strokes: tuple[Stroke, ...]
    options: EditOptions = field(default_factory=EditOptions)
    kind: ClassVar[str] = "sketch"

    @property
    def title(self) -> str:
        """A few words for the list of steps."""
        return "Sketch" if len(self.strokes) < 2 else f"Sketch, {len(self.strokes)} curves"

    def prepare(
        self, mesh: Mesh, run: Run | None = None, decomposition: Decomposition | None = None
    ) -> PreparedEdit:
        """Do everything that does not depend on the targets; `run.memo` keeps it.

        Parameters
        ----------
        mesh : the mesh that the edit is made on.
        run : progress, cancel, memory.
        decomposition : of the same mesh, region and rim rule, if it is at hand already and
            reaches the level; the result is the same.

        Raises
        ------
        RecipeError
            The edit refers to vertices that the mesh does not have, or holds absurd numbers.
        RegionError, SolveError, SketchError, Cancelled
        """
        self.check(mesh)
        anchors = tuple(stroke.anchors for stroke in self.strokes)
        return prepare_edit(
            mesh, self.roi, self.level, anchors, self.options, run or Run(), decomposition
        )

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the mesh with the edit done and its details put back, on the same faces."""
        result = self.prepare(mesh, run).solve(self.strokes)
        return mesh.with_vertices(result.vertices)

    def check(self, mesh: Mesh) -> None:
        """Refuse an edit that cannot be meant for `mesh`.

        Raises
        ------
        RecipeError
        """
        if not 0.0 <= self.level <= 1.0:
            raise RecipeError(f"The level is {self.level}; it must lie between 0 and 1.")
        check_options(self.options)
        for stroke in self.strokes:
            check_stroke(stroke)
        ids = [np.asarray(self.roi), np.array(self.options.pins, dtype=np.int64)]
        ids += [stroke.anchors for stroke in self.strokes]
        highest = max((int(i.max()) for i in ids if len(i)), default=0)
        if highest >= mesh.n or any(int(i.min()) < 0 for i in ids if len(i)):
            raise RecipeError(
                f"The edit refers to vertex {highest}, but the mesh has {mesh.n}. "
                "It was made on another mesh: transfer it to this one."
            )

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON data."""
        return {
            "roi": ids_to_text(np.unique(np.asarray(self.roi, dtype=np.int64))),
            "level": self.level,
            "strokes": [stroke.to_json() for stroke in self.strokes],
            "options": self.options.to_json(),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """Build the edit from what `to_json` gave.

        Raises
        ------
        RecipeError
            Something is missing, unknown, of another type or shape, or absurd.
        """
        _refuse_unknown(data, {"roi", "level", "strokes", "options"}, "A sketch")
        for name in ("roi", "level", "strokes"):
            if name not in data:
                raise RecipeError(f"A sketch lacks “{name}”. Add it.")
        roi, level, strokes = data["roi"], data["level"], data["strokes"]
        if isinstance(roi, list):
            ids = np.unique(_numbers(roi, np.int64, "A sketch's region", 1))
        elif isinstance(roi, str):
            ids = ids_from_text(roi)
        else:
            raise RecipeError("A sketch's region must be vertex ids, such as “3-17 20”.")
        if len(ids) == 0 or ids[0] < 0:
            raise RecipeError("A sketch's region must hold vertex ids from 0 up.")
        if not isinstance(strokes, list):
            raise RecipeError("A sketch's strokes must be a list.")
        return cls(
            frozen(ids, np.int64),
            _number(level, "A sketch's level", 0.0, 1.0),
            tuple(Stroke.from_json(stroke) for stroke in strokes),
            EditOptions.from_json(data.get("options", {})),
        )


def check_stroke(stroke: Stroke) -> None:
    """Refuse a stroke whose parts do not fit each other or hold absurd numbers.

    Raises
    ------
    RecipeError
    """
    anchors, target = np.asarray(stroke.anchors), np.asarray(stroke.target)
    if anchors.ndim != 1 or len(anchors) == 0 or anchors.dtype.kind not in "iu":
        raise RecipeError("A stroke's anchors must be a list of vertex ids.")
    if len(np.unique(anchors)) != len(anchors):
        raise RecipeError("A stroke names an anchor twice. Each vertex may be there once.")
    if target.shape != (len(anchors), 2):
        raise RecipeError(
            f"A stroke has {len(anchors)} anchors and a target of the shape {target.shape}. "
            "Give one x, y for each anchor."
        )
    if not (np.abs(target) <= FARTHEST_TARGET_PX).all():
        raise RecipeError(
            "A stroke's target lies more than a million pixels away. Draw it inside the window."
        )
    if stroke.weights is not None:
        weights = np.asarray(stroke.weights)
        if weights.shape != (len(anchors),) or not ((weights > 0) & (weights <= 1)).all():
            raise RecipeError(
                "A stroke's weights must be one number for each anchor, above 0, up to 1."
            )


def check_options(options: EditOptions) -> None:
    """Refuse options of a wrong type or outside their limits.

    Raises
    ------
    RecipeError
    """
    if options.rim not in ("smooth", "paper"):
        raise RecipeError("The option “rim” must be “smooth” or “paper”.")
    for name in ("rectify", "free_borders"):
        if not isinstance(getattr(options, name), bool):
            raise RecipeError(f"The option “{name}” must be true or false.")
    _number(options.depth_hold, "The option “depth_hold”", 0.0, 1e6)
    _number(options.amount, "The option “amount”", 0.0, 1.5)
    if type(options.polish) is not int or not 0 <= options.polish <= 1000:
        raise RecipeError("The option “polish” must be a whole number from 0 to 1000.")
    if any(type(pin) is not int or pin < 0 for pin in options.pins):
        raise RecipeError("The option “pins” must be a list of vertex ids.")
    plane = np.array(options.mirror, dtype=np.float64)
    if len(plane) not in (0, 4) or not np.isfinite(plane).all():
        raise RecipeError("The option “mirror” must be four numbers a, b, c, d, or an empty list.")
    if len(plane) == 4 and not np.linalg.norm(plane[:3]) > 0:
        raise RecipeError("The option “mirror” needs a plane's normal that is not zero.")


def _refuse_unknown(data: dict[str, Any], known: set[str], what: str) -> None:
    unknown = sorted(set(data) - known)
    if unknown:
        raise RecipeError(
            f"{what} has no field {unknown[0]!r}. It has: {', '.join(sorted(known))}."
        )


def _number(value: Any, what: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating):
        raise RecipeError(f"{what} must be a number.")
    if not low <= value <= high:
        raise RecipeError(f"{what} is {value}; it must lie between {low:g} and {high:g}.")
    return float(value)


def _numbers(value: Any, dtype: type, what: str, ndim: int) -> Any:
    words = "whole numbers" if dtype is np.int64 else "finite numbers"
    try:
        array = np.asarray(value if not isinstance(value, str) else None)
    except (ValueError, OverflowError) as error:
        raise RecipeError(f"{what} must be {words}, all rows of the same length.") from error
    if array.size == 0:
        array = np.zeros((0,) * ndim, dtype=dtype)
    allowed = "iu" if dtype is np.int64 else "iuf"
    if array.ndim != ndim or array.dtype.kind not in allowed or not np.isfinite(array).all():
        raise RecipeError(f"{what} must be {words}.")
    if dtype is np.int64 and array.size and (array.max() >= 2**62 or array.min() < 0):
        raise RecipeError(f"{what} must be {words} from 0 up.")
    return frozen(_as(array, dtype), dtype)


def _as(array: ArrayLike, dtype: type) -> Any:
    return np.asarray(array, dtype=dtype)
