"""Replay a recipe in a process of its own: `python -m tests.engine.replay_once RECIPE MESH OUT`.

OUT gets the positions after each step, so that one that differs is told from those that follow.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from engine import Mesh, Recipe
from engine.applied import applied
from engine.arrays import F64, I64
from plugins.registry import kinds


def after_each_step(recipe: Recipe, mesh: Mesh) -> dict[str, F64 | I64]:
    """Return positions and faces after each step, named by its number and kind."""
    found: dict[str, F64 | I64] = {}
    for number, step in enumerate(recipe.steps, 1):
        if number - 1 not in recipe.muted:
            mesh = applied(step, mesh)
        found[f"{number:02} {step.kind} vertices"] = mesh.vertices
        found[f"{number:02} {step.kind} faces"] = mesh.faces
    return found


def main(recipe: Path, mesh: Path, out: Path) -> None:
    """Read the recipe and the mesh (`.npz`), and write what each step gives (`.npz`)."""
    with np.load(mesh) as arrays:
        begun = Mesh(arrays["vertices"], arrays["faces"])
    steps = Recipe.from_json(recipe.read_text(encoding="utf-8"), kinds())
    np.savez(out, **after_each_step(steps, begun))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
