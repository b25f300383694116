"""Replay a recipe in a process of its own: `python -m tests.engine.replay_once RECIPE MESH OUT`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from engine import Mesh, Recipe, replay
from plugins.registry import kinds


def main(recipe: Path, mesh: Path, out: Path) -> None:
    """Read the recipe and the mesh (`.npz`), and write the positions after it (`.npy`)."""
    with np.load(mesh) as arrays:
        begun = Mesh(arrays["vertices"], arrays["faces"])
    steps = Recipe.from_json(recipe.read_text(encoding="utf-8"), kinds())
    np.save(out, replay(steps, begun).vertices)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
