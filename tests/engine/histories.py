"""Small histories for the tests of document files and journals, and when two are equal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from engine import (
    Document,
    Draft,
    EditOptions,
    History,
    HistoryState,
    Mesh,
    Moment,
    RecipeError,
    Run,
    Source,
    Stroke,
    View,
)
from engine.arrays import F64, I64


@dataclass(frozen=True, eq=False)
class Nudge:
    """Moves the vertices `ids` by the rows of `by`: the least that a step can be."""

    ids: I64
    by: F64
    kind: ClassVar[str] = "nudge"

    @property
    def title(self) -> str:
        return "Nudge"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        vertices = mesh.vertices.copy()
        vertices[self.ids] += self.by
        return mesh.with_vertices(vertices)

    def to_json(self) -> dict[str, Any]:
        return {"ids": self.ids.tolist(), "by": self.by.tolist()}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        by = np.asarray(data["by"], dtype=np.float64)
        if not np.isfinite(by).all():
            raise RecipeError("The nudge has no finite length. Give finite numbers.")
        return cls(np.asarray(data["ids"], dtype=np.int64), by)


KINDS = {"nudge": Nudge}
PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(40))


def grid(side: int = 4) -> Mesh:
    """A square of side * side vertices with a wave on it; no coordinate is a round number."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.sin(7 * x + 3 * y).ravel() / 9]) / 3
    i = np.arange(side * side).reshape(side, side)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel()
    return Mesh(vertices, np.vstack([np.column_stack([a, b, d]), np.column_stack([a, d, c])]))


def view() -> View:
    """A camera with a matrix of no particular form."""
    matrix = np.eye(4) + np.arange(16).reshape(4, 4) / 700
    return View(matrix, (801.5, 600.0))


def history(side: int = 4, steps: int = 2) -> History:
    """A tree: a region, a source, a stroke, steps, a branch with a name, and something undone."""
    mesh = grid(side)
    result = History(Document.open(mesh, "käfer.obj", "in"))
    roi = np.arange(side + 1, 2 * side - 1)
    draft = Draft(roi, 0.1 + 0.2, Source(roi[:2], view(), weights=np.array([0.5, 1 / 3])))
    result.add(result.current.with_draft(draft), "Region")
    stroke = Stroke(roi[:2], view(), np.array([[1 / 7, 2.0], [3e-310, -0.0]]))
    options = EditOptions(rectify=False, depth_hold=0.07)
    draft = Draft(roi, 1 / 3, None, (stroke,), options)
    document = result.current.with_draft(draft).with_region("grïp", roi).with_view("front", view())
    result.add(document, "Target")
    for k in range(steps):
        step = Nudge(roi, np.full((len(roi), 3), 0.1 / (k + 3)))
        document = result.current
        result.add(document.with_step(step, step.apply(document.mesh)), step.title)
    result.rename(result.current_id, "low")
    result.undo()
    step = Nudge(roi[:1], np.array([[-0.0, 1e-17, 0.3]]))
    document = result.current
    result.add(document.with_step(step, step.apply(document.mesh)), "Branch")
    result.undo()
    return result


def fingerprint(state: HistoryState, *, times: bool = True) -> str:
    """Everything that a state holds, as text that differs when any bit does."""
    lines = [f"current {state.current_id} redo {sorted(state.redo.items())}"]
    lines += [marks(state.moments[i], times=times) for i in sorted(state.moments)]
    return "\n".join(lines)


def marks(moment: Moment, *, times: bool = True) -> str:
    """Everything that a moment holds, as text that differs when any bit does."""
    d = moment.document
    return "\n".join(
        (
            f"{moment.id} {moment.parent} {moment.label!r} {moment.name!r} {moment.time * times!r}",
            f" {d.original.digest} {d.mesh.digest} {d.name!r} {d.unit} {d.draft.level!r}",
            f" {d.recipe.to_json()} {_text(d.draft)} {_text(dict(d.regions))}",
            f" {_text(dict(d.views))} {d.mesh.faces is d.original.faces}",
        )
    )


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, dict):
        return str({key: _text(entry) for key, entry in sorted(value.items())})
    if isinstance(value, tuple):
        return str([_text(entry) for entry in value])
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is not None:
        return str({name: _text(getattr(value, name)) for name in fields})
    return repr(value)
