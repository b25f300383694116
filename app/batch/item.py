"""Item: one recipe on one mesh, as data that any machine can work on."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from app.batch.vary import BLEND, file_stem, varied
from engine import F64, I64, EngineError, Mesh, Recipe, replay
from plugins.registry import kinds


@dataclass(frozen=True, eq=False)
class Item:
    """One piece of work; it holds all it needs, so that the workers share no folder.

    Parameters
    ----------
    name : file stem of the result.
    recipe : the recipe as JSON text.
    vertices, faces : the mesh.
    blend : 0 gives the mesh as it is, 1 the recipe's result, between a straight blend.
    force : replay even if the recipe was made on another mesh.
    values : what was varied, for the table.
    """

    name: str
    recipe: str
    vertices: F64
    faces: I64
    blend: float = 1.0
    force: bool = False
    values: tuple[tuple[str, float], ...] = ()

    @property
    def key(self) -> str:
        """Digest of everything the result depends on; finished items are known by it."""
        h = hashlib.sha256(self.recipe.encode())
        h.update(json.dumps([self.blend, self.force]).encode())
        h.update(Mesh(self.vertices, self.faces).digest.encode())
        return h.hexdigest()


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of an item: a mesh, or the reason why there is none."""

    name: str
    vertices: F64 | None
    faces: I64 | None
    reason: str
    seconds: float
    moved: float


def work(item: Item) -> Outcome:
    """Replay the item's recipe; an item that fails says why and stops nothing else.

    One thread does it: the others belong to other items, and the bits do not depend on them.
    """
    begin = time.perf_counter()
    try:
        with threadpool_limits(1):
            mesh = Mesh(item.vertices, item.faces)
            recipe = Recipe.from_json(item.recipe, kinds())
            result = replay(recipe, mesh, force=item.force)
            result = _blended(mesh, result, item.blend)
            moved = (
                float(np.linalg.norm(result.vertices - mesh.vertices, axis=1).max())
                if result.vertices.shape == mesh.vertices.shape
                else float("nan")
            )
    except EngineError as error:
        return Outcome(item.name, None, None, str(error), time.perf_counter() - begin, 0.0)
    except Exception as error:  # noqa: BLE001
        # A step by a third party may raise anything; it must cost its own item only.
        reason = f"A step failed ({type(error).__name__}: {error})."
        return Outcome(item.name, None, None, reason, time.perf_counter() - begin, 0.0)
    seconds = time.perf_counter() - begin
    return Outcome(item.name, result.vertices, result.faces, "", seconds, moved)


def _blended(mesh: Mesh, result: Mesh, blend: float) -> Mesh:
    if blend == 1.0:
        return result
    if result.vertices.shape != mesh.vertices.shape:
        raise EngineError(
            "The recipe changes the number of vertices, so its result cannot be blended with the "
            "mesh. Leave out blend."
        )
    return result.with_vertices((1 - blend) * mesh.vertices + blend * result.vertices)


def variant_items(
    recipe: Recipe, mesh: Mesh, values: list[dict[str, float]], force: bool
) -> list[Item]:
    """Return one item for each set of values of a sweep."""
    return [
        Item(
            name=file_stem(v),
            recipe=varied(recipe, v).to_json(),
            vertices=mesh.vertices,
            faces=mesh.faces,
            blend=v.get(BLEND, 1.0),
            force=force,
            values=tuple(v.items()),
        )
        for v in values
    ]
