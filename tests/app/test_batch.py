"""Sweeps and batches on a real scheduler with two workers, one of them killed on the way."""

from __future__ import annotations

import csv
import json
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from app.batch.item import Item, variant_items, work
from app.batch.vary import Variation, combinations, varied
from engine import EngineError, Mesh, Recipe, load, replay, save
from plugins.inflate import InflateStep
from plugins.registry import kinds
from plugins.smooth import SmoothStep


def plate(side: int = 21) -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 40, side), np.linspace(0, 40, side), indexing="ij")
    i, j = np.meshgrid(np.arange(side - 1), np.arange(side - 1), indexing="ij")
    a = (i * side + j).ravel()
    quads = np.column_stack([a, a + side, a + side + 1, a + 1])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(np.column_stack([u.ravel(), v.ravel(), np.sin(u.ravel())]), faces)


def middle(mesh: Mesh) -> np.ndarray:
    x = mesh.vertices[:, :2]
    return np.flatnonzero(((x > 6) & (x < 34)).all(axis=1))


def example(mesh: Mesh) -> Recipe:
    roi = middle(mesh)
    return Recipe((SmoothStep(roi, 0.0, 0.5), InflateStep(roi, 2.0)), mesh.digest)


def test_what_to_vary_is_read() -> None:
    assert Variation.parse("level=0:1:3") == Variation("level", (0.0, 0.5, 1.0))
    assert Variation.parse("2.distance=1,4") == Variation("2.distance", (1.0, 4.0))


@pytest.mark.parametrize("text", ["level", "=1:2:3", "a=1:2", "a=1:2:0", "a=x", "a=nan:1:2", "a="])
def test_what_cannot_be_varied_is_refused(text: str) -> None:
    with pytest.raises(EngineError, match="does not say what to vary"):
        Variation.parse(text)


def test_numbers_are_found_by_name_and_by_step() -> None:
    recipe = example(plate())
    assert varied(recipe, {"amount": 0.25}).steps[0].amount == 0.25
    assert varied(recipe, {"2.distance": -3.0}).steps[1].distance == -3.0
    assert recipe.steps[1].distance == 2.0
    for name in ("size", "3.amount", "0.amount"):
        with pytest.raises(EngineError, match=f"called “{name}”"):
            varied(recipe, {name: 1.0})
    with pytest.raises(EngineError, match="between 0 and 1"):
        varied(recipe, {"amount": 3.0})


def test_options_that_a_recipe_leaves_at_their_defaults_can_be_varied() -> None:
    text = (Path(__file__).parents[2] / "resources" / "recipes" / "vase.json").read_text("utf-8")
    recipe = Recipe.from_json(text, kinds())
    assert varied(recipe, {"amount": 0.5}).steps[0].options.amount == 0.5
    assert varied(recipe, {"polish": 2.0}).steps[0].options.polish == 2


def test_all_combinations_and_not_too_many() -> None:
    two = [Variation("a", (0.0, 1.0)), Variation("b", (5.0, 6.0))]
    assert list(combinations(two))[1] == {"a": 0.0, "b": 6.0}
    many = [Variation(n, tuple(map(float, range(1000)))) for n in "ab"]
    with pytest.raises(EngineError, match="1,000,000 variants"):
        list(combinations(many))


def test_an_item_gives_what_replay_gives_and_blends() -> None:
    mesh = plate()
    recipe = example(mesh)
    whole = replay(recipe, mesh)
    for blend in (1.0, 0.25):
        outcome = work(Item("x", recipe.to_json(), mesh.vertices, mesh.faces, blend))
        assert outcome.reason == ""
        wanted = (
            (1 - blend) * mesh.vertices + blend * whole.vertices if blend < 1 else whole.vertices
        )
        assert (outcome.vertices == wanted).all()


def test_an_item_that_fails_says_why() -> None:
    mesh = plate()
    recipe = Recipe((SmoothStep(np.arange(mesh.n + 5), 0.0, 0.5),), mesh.digest)
    outcome = work(Item("x", recipe.to_json(), mesh.vertices, mesh.faces))
    assert outcome.vertices is None
    assert "region" in outcome.reason


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    mesh = plate()
    save(mesh, tmp_path / "plate.ply")
    opened = load(tmp_path / "plate.ply")
    recipe = tmp_path / "recipe.json"
    recipe.write_text(example(opened).to_json(), encoding="utf-8")
    return recipe, tmp_path / "plate.ply"


@dataclass(frozen=True)
class Ran:
    """How a command ended, and what it said."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """Run a command of the program on the recipe."""

    def command(name: str, *given: object) -> Ran:
        capsys.readouterr()
        code = main([name, str(files[0]), *map(str, given)])
        return Ran(code, *capsys.readouterr())

    return command


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_sweep_survives_a_killed_worker_and_resumes(
    run: Callable[..., Ran], files: tuple[Path, Path], tmp_path: Path
) -> None:
    from distributed import Client, LocalCluster

    recipe, mesh_file = files
    out = tmp_path / "out"
    asked = [mesh_file, "--vary", "2.distance=0:6:4", "--vary", "amount=0:1:3", "--out", out]
    import dask

    with (
        dask.config.set({"distributed.worker.daemon": False}),
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as here,
    ):
        pids = here.run(os.getpid)
        # The scheduler is told to start with a worker that dies while it holds work.
        victim = next(iter(pids.values()))
        here.submit(_kill_later, victim, pure=False)
        assert run("sweep", *asked, "--scheduler", cluster.scheduler_address).code == 0
    rows = list(csv.DictReader((out / "table.csv").open(encoding="utf-8")))
    assert len(rows) == 12
    assert all(row["ok"] == "True" for row in rows)
    mesh = load(mesh_file)
    made = Recipe.from_json(recipe.read_text(encoding="utf-8"), kinds())
    for row in rows:
        values = {"2.distance": float(row["2.distance"]), "amount": float(row["amount"])}
        (item,) = variant_items(made, mesh, [values], force=False)
        wanted = replay(Recipe.from_json(item.recipe, kinds()), mesh)
        assert (load(out / row["file"]).vertices == wanted.vertices).all()
    assert (out / "contact-sheet.png").stat().st_size > 10_000

    first = out / rows[0]["file"]
    lost = out / rows[1]["file"]
    stamp = first.stat().st_mtime_ns
    lost.unlink()
    again = run("sweep", *asked, "--no-sheet", "--workers", 1)
    assert again.code == 0
    assert "1 of 12" not in again.out
    assert first.stat().st_mtime_ns == stamp
    assert lost.is_file()


def _kill_later(pid: int) -> None:
    time.sleep(0.2)
    os.kill(pid, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_batch_goes_on_after_a_failure_and_says_so(
    run: Callable[..., Ran], files: tuple[Path, Path], tmp_path: Path
) -> None:
    small = tmp_path / "small.ply"
    save(plate(5), small)
    broken = tmp_path / "broken.ply"
    broken.write_bytes(b"ply\n")
    out = tmp_path / "family"
    meshes = (files[1], small, broken)
    said = run("batch", *meshes, "--out", out, "--force", "--workers", 2, "--no-sheet")
    assert said.code == 1
    assert "1 of 3 done" in said.out
    assert "small:" in said.err
    assert "broken" in said.err
    assert (out / "plate.ply").is_file()
    assert not (out / "small.ply").exists()
    table = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert [row["ok"] for row in table] == [True, False, False]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_batch_carries_the_recipe_to_other_triangles(
    run: Callable[..., Ran], files: tuple[Path, Path], tmp_path: Path
) -> None:
    recipe, mesh_file = files
    sibling = plate(31)
    save(sibling, tmp_path / "sibling.ply")
    out = tmp_path / "carried"
    asked = [tmp_path / "sibling.ply", "--out", out, "--workers", 1]
    assert run("batch", *asked, "--no-sheet").code == 1, "it was made on another mesh"
    refused = run("batch", *asked, "--transfer")
    assert refused.code == 2
    assert "--from-mesh" in refused.err
    assert run("batch", *asked, "--no-sheet", "--transfer", "--from-mesh", mesh_file).code == 0
    made = load(mesh_file)
    wanted = replay(Recipe.from_json(recipe.read_text(encoding="utf-8"), kinds()), made)
    lifted = load(out / "sibling.ply").vertices
    middle_of = [np.linalg.norm(x[:, :2] - 20, axis=1).argmin() for x in (lifted, wanted.vertices)]
    # Without the recipe the middles would be more than two apart.
    assert abs(lifted[middle_of[0], 2] - wanted.vertices[middle_of[1], 2]) < 0.5
