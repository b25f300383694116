"""Replay of a recipe from file to file, and the report of what each step did."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from engine import (
    FileError,
    Mesh,
    Recipe,
    RecipeError,
    Run,
    SketchEdit,
    Step,
    applied,
    open_file,
    save,
)
from engine.files.place import read_whole, readable_size, write_file
from engine.files.report import shown
from engine.measure import (
    edge_stretch,
    feature_amplitude,
    feature_heights,
    rim_dihedral,
    target_error,
)
from plugins.registry import kinds

LARGEST_RECIPE = 1 << 28
"""Bytes; a curve of ten thousand points on a million vertices has a hundredth of it."""


def replay_file(
    recipe_path: Path, source: Path, out: Path, report: Path | None = None, force: bool = False
) -> None:
    """Apply the recipe in a file to the mesh in another, write the result and a report.

    Parameters
    ----------
    force : replay also on a mesh that the recipe was not made on.

    Raises
    ------
    FileError, RecipeError, EngineError
        A file cannot be read or written, or a step refuses.
    """
    recipe = read_recipe(recipe_path)
    mesh = open_for(recipe, source, force)
    run = Run()
    steps: list[dict[str, Any]] = []
    for i, step in enumerate(recipe.steps):
        if i in recipe.muted:
            continue
        changed = applied(step, mesh, run)
        if report is not None:
            steps.append(measured(step, mesh, changed, run))
        mesh = changed
    save(mesh, out)
    if report is not None:
        write_json(report, {"mesh": recipe.digest, "result": mesh.digest, "steps": steps})


def read_recipe(path: Path) -> Recipe:
    """Return the recipe in a file."""
    name = shown(path.name)
    if readable_size(path) > LARGEST_RECIPE:
        raise FileError(
            f"“{name}” is larger than any recipe. Choose a file that Eigenform wrote as one."
        )
    try:
        text = read_whole(path, name).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(
            f"“{name}” is not the text of a recipe. Choose a file that Eigenform wrote as one."
        ) from error
    return Recipe.from_json(text, kinds())


def open_for(recipe: Recipe, source: Path, force: bool) -> Mesh:
    """Return the mesh in a file, cleaned or as it is: whichever the recipe was made on."""
    found = open_file(source)
    if force or not recipe.digest or found.mesh.digest == recipe.digest:
        return found.mesh
    if found.as_read.digest == recipe.digest:
        return found.as_read
    raise RecipeError(
        f"The recipe was made on another mesh than {shown(source.name)}. Give that mesh, or add "
        "--force to replay it on this one."
    )


def measured(step: Step, before: Mesh, after: Mesh, run: Run) -> dict[str, Any]:
    """Return what a step did, as plain data: px, mesh units, degrees and ratios.

    A step that is not a sketch is told by its kind and title, and the number of changed vertices.
    """
    told: dict[str, Any] = {"kind": step.kind, "title": step.title}
    if after.faces is before.faces:
        told["moved_vertices"] = int((after.vertices != before.vertices).any(axis=1).sum())
    if isinstance(step, SketchEdit):
        told |= sketch_figures(step, before, after, run)
    return told


def sketch_figures(edit: SketchEdit, before: Mesh, after: Mesh, run: Run) -> dict[str, Any]:
    """Return the figures of one sketch edit; `run` remembers what `edit.apply` prepared."""
    prepared = edit.prepare(before, run)
    result = prepared.solve(edit.strokes)
    roi = prepared.decomposition.roi
    level_before = before.vertices.copy()
    level_before[roi] = prepared.decomposition.surface(prepared.k)
    plain, bent = before.with_vertices(level_before), before.with_vertices(result.level_vertices)
    parts = prepared.decomposition
    amplitude, kept = (
        feature_amplitude(
            feature_heights(below, whole, roi), parts.areas, parts.region.stiffness_roi
        )
        for below, whole in ((plain, before), (bent, after))
    )
    return {
        "region_vertices": len(roi),
        "level": edit.level,
        "modes": prepared.k,
        "target_error_px": target_error(result.level_vertices, edit.strokes),
        "feature_amplitude": {
            "before": amplitude.rms,
            "after": kept.rms,
            "ratio": kept.rms / amplitude.rms if amplitude.rms > 0 else 1.0,
        },
        "rim_dihedral_p95_degrees": {
            "before": math.degrees(rim_dihedral(before, roi)),
            "level": math.degrees(rim_dihedral(plain, roi)),
            "after": math.degrees(rim_dihedral(after, roi)),
        },
        "edge_stretch": asdict(edge_stretch(before, after, roi)),
    }


def write_json(path: Path, data: Any) -> None:
    """Write plain data as readable JSON."""
    write_file(path, (json.dumps(data, indent=1, allow_nan=False) + "\n").encode("utf-8"))
