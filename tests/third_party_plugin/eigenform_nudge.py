"""Nudge: press on the form and drag; what lies near the press goes along."""

from dataclasses import dataclass, field

import numpy as np

from plugins.api import DataStep, EngineError, Tool


@dataclass(frozen=True, eq=False)
class NudgeStep(DataStep):
    """Moves what lies within `radius` of the vertex `centre` by `by`, smoothly less further out."""

    centre: int
    radius: float
    by: tuple[float, ...]
    kind = "nudge"
    label = "Nudge"

    def apply(self, mesh, run=None):
        away = np.linalg.norm(mesh.vertices - mesh.vertices[self.centre], axis=1)
        share = np.clip(1 - (away / self.radius) ** 2, 0, 1) ** 2
        return mesh.with_vertices(mesh.vertices + share[:, None] * np.array(self.by))


@dataclass(frozen=True)
class NudgeOptions:
    radius: float = field(default=20.0, metadata={"label": "Radius", "min": 0.1, "unit": "mm"})


class Nudge(Tool):
    id = "nudge"
    title = "Nudge"
    tip = "Press on the form and drag"
    icon = "mdi6.cursor-move"
    shortcut = "J"
    Options = NudgeOptions

    def gesture(self, context, pointer):
        hit = context.pick(pointer.x, pointer.y)
        if hit is None:
            raise EngineError("There is no form under the pointer. Press on the form.")
        start, step = np.array(pointer.xy), None
        while pointer.kind != "release":
            pointer = yield
            by = to_space(context.view, hit.point, np.array(pointer.xy) - start)
            step = NudgeStep(hit.vertex, context.options.radius, tuple(by.tolist()))
            context.preview(step)
        return step


def to_space(view, point, drag):
    """Return the shortest move of `point`, (3,), that is seen as `drag`, (2,) px."""
    rows = view.pixel_matrix
    u, v, w = rows[:, :3] @ point + rows[:, 3]
    seen = np.array([rows[0, :3] - u / w * rows[2, :3], rows[1, :3] - v / w * rows[2, :3]]) / w
    return np.linalg.pinv(seen) @ drag


class Clumsy(Tool):
    """A tool with a bug, as strangers' tools have."""

    id = "clumsy"
    title = "Clumsy"
    shortcut = "L"  # the lasso's

    def gesture(self, context, pointer):
        yield
        raise ZeroDivisionError("division by zero")
