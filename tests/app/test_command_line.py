"""The command line: replay, demo, what it says and how it ends. No window is opened."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.__main__ import main
from app.demo import RECIPES, demo, read_example
from engine import open_file, replay
from resources import SAMPLES, sample_path
from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[2]


def test_replay_writes_what_the_recipe_gives(tmp_path: Path) -> None:
    out, report = tmp_path / "out.ply", tmp_path / "report.json"
    files = [str(path) for path in (RECIPES / "vase.json", sample_path("vase"), out)]
    code = main(["replay", *files, "--report", str(report)])
    assert code == 0
    recipe = read_example("vase").recipe
    original = open_file(sample_path("vase")).mesh
    expected = replay(recipe, original)
    written = open_file(out, clean=False).mesh
    assert (written.vertices == expected.vertices).all()
    assert (written.faces == original.faces).all()
    (step,) = json.loads(report.read_text())["steps"]
    moved = (expected.vertices != original.vertices).any(axis=1).sum()
    assert step["moved_vertices"] == moved > 1000
    assert step["target_error_px"] < 0.5
    assert step["feature_amplitude"]["ratio"] == pytest.approx(1.0, abs=0.05)
    rim = step["rim_dihedral_p95_degrees"]
    assert rim["level"] <= rim["before"]
    assert 0.5 < step["edge_stretch"]["p5"] <= 1 <= step["edge_stretch"]["p95"] < 2


def test_replay_on_another_mesh_is_refused_with_the_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.ply"
    code = main(["replay", str(RECIPES / "vase.json"), str(sample_path("tank")), str(out)])
    said = capsys.readouterr().err
    assert code == 2
    assert "another mesh" in said
    assert "--force" in said
    assert "Traceback" not in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "fact"),
    [(None, "is not there"), ("{", "not valid JSON"), ("[]", "not an Eigenform recipe")],
)
def test_a_bad_recipe_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None, fact: str
) -> None:
    path = tmp_path / "recipe.json"
    if text is not None:
        path.write_text(text)
    assert main(["replay", str(path), str(sample_path("vase")), str(tmp_path / "o.ply")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("eigenform: ")
    assert fact in said
    assert said.count("\n") == 1


def test_a_file_that_cannot_be_written_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "no" / "such" / "folder" / "out.ply"
    code = main(["replay", str(RECIPES / "plate.json"), str(sample_path("plate")), str(missing)])
    assert code == 2
    assert "out.ply" in capsys.readouterr().err


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    hidden = ("DISPLAY", "WAYLAND_DISPLAY")
    env = {k: v for k, v in os.environ.items() if k not in hidden} | environment
    return subprocess.run(
        [sys.executable, "-m", "app", *arguments],
        capture_output=True, text=True, cwd=ROOT, env=env, timeout=PATIENCE, check=False,
    )  # fmt: skip


def test_a_file_without_a_display_is_refused_in_one_line() -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("only X and Wayland can be without a display")
    done = run("model.obj")
    assert done.returncode == 2
    assert done.stderr.startswith("eigenform: There is no display")
    assert done.stderr.count("\n") == 1


def test_help_names_the_commands_and_version_the_version() -> None:
    told = run("--help")
    assert told.returncode == 0
    for command in ("replay", "demo", "sweep", "batch"):
        assert command in told.stdout
    assert run("--version").stdout.startswith("eigenform ")
    assert run("demo", "teapot", "--out", "x").returncode == 2


def test_blas_threads_are_limited_before_numpy_is_loaded() -> None:
    code = (
        "import sys, app.__main__, os; "
        "assert 'numpy' not in sys.modules; print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    env = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=env,
        timeout=PATIENCE,
        check=False,
    )
    assert done.stdout.strip() == "1", done.stderr


def test_demo_without_a_display_makes_pictures_mesh_recipe_and_report(tmp_path: Path) -> None:
    done = run("demo", "vase", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert str(tmp_path) in done.stdout
    assert done.stderr == ""
    names = {path.name for path in tmp_path.iterdir()}
    assert {"vase.ply", "recipe.json", "report.json", "figure-12.png"} <= names
    pictures = sorted(tmp_path.glob("*.png"))
    assert len(pictures) == 13
    for path in pictures:
        spread = np.asarray(Image.open(path).convert("RGB"), dtype=float).std(axis=(0, 1))
        assert (spread > 5).all(), f"{path.name} is empty"
    again = tmp_path / "again.ply"
    assert (
        main(["replay", str(tmp_path / "recipe.json"), str(sample_path("vase")), str(again)]) == 0
    )
    assert again.read_bytes() == (tmp_path / "vase.ply").read_bytes()


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_shipped_recipes_fit_their_samples_and_keep_the_features(name: str) -> None:
    from app.headless import sketch_figures
    from engine import Run, SketchEdit

    recipe = read_example(name).recipe
    mesh = open_file(sample_path(name)).mesh
    assert recipe.digest == mesh.digest, "run python -m app.draw_examples again"
    run_ = Run()
    for step in recipe.steps:
        assert isinstance(step, SketchEdit)
        changed = step.apply(mesh, run_)
        figures = sketch_figures(step, mesh, changed, run_)
        assert figures["target_error_px"] < 0.5
        assert figures["feature_amplitude"]["ratio"] == pytest.approx(1.0, abs=0.05)
        assert changed.faces is mesh.faces
        mesh = changed


def test_the_drill_is_edited_at_two_levels() -> None:
    first, second = read_example("drill").recipe.steps
    assert first.level == 0.0
    assert 0 < second.level < 1


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    from engine import FileError

    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot be made"):
        next(demo("vase", tmp_path / "file" / "out"))
