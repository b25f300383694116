"""The same recipe on the same mesh gives the same bytes: in other processes, with 1 or 2 threads.

What is promised is a difference below 1e-9 of the diagonal; what is measured is none at all, as
long as the BLAS libraries are the same.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from engine import EditOptions, Mesh, Recipe, SketchEdit, Source, Stroke, View, load, replay
from engine.arrays import F64
from resources import sample_path
from tests.engine.every_step import bumpy, every_step, sketches
from tests.engine.replay_once import after_each_step
from tests.engine.shapes import sphere
from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
PROMISED = 1e-9  # of the diagonal


def view_from_above() -> View:
    """An orthographic camera that looks down the z axis on 160 mm."""
    return View(np.diag([1 / 80.0, 1 / 80.0, -1 / 500.0, 1.0]), (800.0, 800.0))


def cap(mesh: Mesh, height: float) -> SketchEdit:
    """An edit of the cap of a sphere above z = height: a line across it is bowed."""
    view = view_from_above()
    x = np.linspace(-16, 16, 30)
    wanted = np.column_stack([x, np.zeros_like(x), np.full_like(x, 50.0)])
    distance = np.linalg.norm(mesh.vertices[None] - wanted[:, None], axis=2)
    anchors = np.array(list(dict.fromkeys(distance.argmin(axis=1).tolist())))
    target = Source(anchors, view).still(mesh).target
    target[:, 1] += 60 * np.sin(np.linspace(0, np.pi, len(anchors)))
    roi = np.flatnonzero(mesh.vertices[:, 2] > height)
    return SketchEdit(roi, 0.6, (Stroke(anchors, view, target),), EditOptions())


def elsewhere(recipe: Path, mesh: Path, out: Path, threads: int) -> dict[str, F64]:
    """Replay in a fresh process with so many threads; return what each step gave."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    subprocess.run(
        [sys.executable, "-m", "tests.engine.replay_once", str(recipe), str(mesh), str(out)],
        cwd=ROOT,
        check=True,
        timeout=PATIENCE,
        env={**os.environ, **dict.fromkeys(names, str(threads))},
    )
    with np.load(out) as found:
        return dict(found)


def compare(mesh: Mesh, recipe: Recipe, folder: Path, rounds: tuple[int, ...]) -> None:
    recipe_file, mesh_file = folder / "recipe.json", folder / "mesh.npz"
    recipe_file.write_text(recipe.to_json(), encoding="utf-8")
    np.savez(mesh_file, vertices=mesh.vertices, faces=mesh.faces)
    here = after_each_step(recipe, mesh)
    *_, vertices, _faces = here.values()
    grown = len(vertices) != mesh.n
    assert grown or np.abs(vertices - mesh.vertices).max() > 1e-3 * mesh.diagonal, "does something"
    again = replay(recipe, mesh)
    assert again.vertices.tobytes() == vertices.tobytes()
    steps = len(recipe.steps)
    for number, threads in enumerate(rounds):
        there = elsewhere(recipe_file, mesh_file, folder / f"{number}.npz", threads)
        assert list(there) == list(here)
        worst = 0.0
        for name, one in here.items():
            other = there[name]
            assert one.shape == other.shape, name
            worst = max(worst, float(np.abs(other - one).max()) / mesh.diagonal)
            assert worst < PROMISED, name
            assert one.tobytes() == other.tobytes(), f"{name}, {threads} threads"
        print(f"{steps} steps, {threads} threads: {worst:.1e} of the diagonal apart")


def moves_at_each_step(recipe: Recipe, mesh: Mesh) -> bool:
    """Whether every step of the recipe does something."""
    before = mesh.vertices
    for name, array in after_each_step(recipe, mesh).items():
        if name.endswith("vertices"):
            if len(array) == len(before):
                assert np.abs(array - before).max() > 1e-3 * mesh.diagonal, name
            before = array
    return True


@pytest.mark.parametrize(
    ("level", "rounds"), [(4, (1, 2)), pytest.param(5, (1, 1, 2, 2), marks=pytest.mark.soak)]
)
def test_every_kind_of_step_replays_to_the_same_bytes(
    level: int, rounds: tuple[int, ...], tmp_path: Path
) -> None:
    mesh = bumpy(level)
    steps = every_step(mesh)
    recipe = Recipe(tuple(steps.values()), digest=mesh.digest)
    assert {"closed", "several strokes", "mirrored", "handle", "morph", "remesh"} <= set(steps)
    finer = replay(recipe, mesh)
    recipe = recipe.with_step(sketches(finer)["closed"])
    assert moves_at_each_step(recipe, mesh)
    compare(mesh, recipe, tmp_path, rounds)


@pytest.mark.parametrize("rounds", [(2,), pytest.param((1, 1, 2, 2), marks=pytest.mark.soak)])
def test_dense_and_banded_modes_replay_to_the_same_bytes(
    rounds: tuple[int, ...], tmp_path: Path
) -> None:
    round_one = sphere(5)
    x = round_one.vertices
    bumps = 0.04 * np.sin(9 * x[:, :1]) * np.sin(9 * x[:, 1:2]) * np.sin(9 * x[:, 2:])
    mesh = round_one.with_vertices(50 * x * (1 + bumps))
    small, large = cap(mesh, 38.0), cap(mesh, 2.0)
    assert len(small.roi) < 1500 < len(large.roi), "dense and in bands"
    recipe = Recipe(digest=mesh.digest).with_step(small).with_step(large)
    compare(mesh, recipe, tmp_path, rounds)


@pytest.mark.soak
@pytest.mark.parametrize("name", ["vase", "tank", "drill", "plate"])
def test_the_shipped_recipes_replay_to_the_same_bytes(name: str, tmp_path: Path) -> None:
    text = (ROOT / "resources" / "recipes" / f"{name}.json").read_text(encoding="utf-8")
    compare(load(sample_path(name)), Recipe.from_json(text), tmp_path, (1, 1, 2, 2))
