"""An edit tool in twenty lines: press on the form and drag; what lies near goes along."""

from dataclasses import dataclass

import numpy as np

from plugins.api import DataStep, Tool


@dataclass(frozen=True, eq=False)
class PushStep(DataStep):
    centre: int
    by: tuple[float, ...]
    reach: float = 15.0
    kind = "push"
    label = "Push"

    def apply(self, mesh, run=None):
        away = np.linalg.norm(mesh.vertices - mesh.vertices[self.centre], axis=1)
        share = np.clip(1 - (away / self.reach) ** 2, 0, 1) ** 2
        return mesh.with_vertices(mesh.vertices + np.outer(share, self.by))


class Push(Tool):
    id = "push"
    title = "Push"
    tip = "Press on the form and drag to the right to push it in, to the left to pull it out"

    def gesture(self, context, pointer):
        hit, start, step = context.pick(*pointer.xy), pointer.x, None
        while hit and pointer.kind != "release":
            pointer = yield
            inwards = -0.1 * (pointer.x - start) * context.shown.vertex_normals[hit.vertex]
            step = PushStep(hit.vertex, tuple(inwards.tolist()))
            context.preview(step)
        return step
