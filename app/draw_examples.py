"""Draws the paper's examples as a person would and writes them down as recipes.

``python -m app.draw_examples [NAME ...]`` takes the lasso, the source and the target of each sample
through the same picking, anchors and resampling as the window and writes `resources/recipes`.
To be run again when a sample's mesh changes. Beside the steps a file keeps the ink as it was drawn,
for the pictures; replay does not read it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from app.demo import RECIPES
from app.pictures import Studio
from engine import (
    F64,
    EditOptions,
    Mesh,
    Recipe,
    Run,
    SketchEdit,
    Stroke,
    View,
    anchor_path,
    decompose,
    open_file,
    resample_target,
)
from engine.view import look_at
from resources import sample_path


@dataclass(frozen=True)
class Pull:
    """A source curve and how its target departs from it.

    Parameters
    ----------
    view : where the source is drawn.
    source : (p, 2) points the curve goes through, px.
    target_view : where the target is drawn.
    offsets : (q, 3) share of the way along the source, and the departure there in px (x, y).
    modes : how many modes the surface has while it is pulled.
    """

    view: View
    source: ArrayLike
    target_view: View
    offsets: ArrayLike
    modes: int = 0


@dataclass(frozen=True)
class Example:
    """A lasso, what is pulled in it, and from where the result is looked at."""

    view: View
    lasso: ArrayLike
    pulls: Sequence[Pull]
    looks: Sequence[View]
    through: bool = False


def through_points(points: ArrayLike, closed: bool = False, spacing: float = 3.0) -> F64:
    """Return a smooth line through `points` (p, 2) with a point every `spacing` pixels."""
    p = np.asarray(points, dtype=np.float64)
    if closed:
        p = np.concatenate([p, p[:1]])
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    line = CubicSpline(chord, p, bc_type="periodic" if closed else "natural")
    return np.asarray(line(np.linspace(0, chord[-1], int(chord[-1] / spacing) + 2)))


def rounded_box(left: float, top: float, right: float, bottom: float, power: float = 4.0) -> F64:
    """Return a lasso around a box with round corners, (p, 2) px."""
    t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    wave = np.stack([np.cos(t), np.sin(t)], axis=1)
    unit = np.sign(wave) * np.abs(wave) ** (2 / power)
    middle = np.array([left + right, top + bottom]) / 2
    return np.asarray(middle + unit * np.array([right - left, bottom - top]) / 2)


def _vase() -> Example:
    front = look_at([0, 0, 111], 560, 90, 6, (800, 1000))
    side = look_at([0, 0, 111], 560, 0, 6, (800, 1000))
    return Example(
        view=front,
        lasso=[
            (400, 335), (500, 345), (546, 400), (564, 500), (560, 590), (534, 670), (498, 735),
            (460, 780), (400, 792), (340, 780), (302, 735), (266, 670), (240, 590), (236, 500),
            (254, 400), (300, 345),
        ],
        pulls=[
            Pull(
                view=front,
                source=[(403, 395), (398, 510), (399, 630), (402, 745)],
                target_view=side,
                offsets=[(0, 0, 0), (0.3, 16, 0), (0.62, 60, 8), (0.86, 26, 3), (1, 0, 0)],
            )
        ],
        looks=[
            look_at([0, 0, 111], 560, 55, 8, (800, 1000)),
            look_at([0, 0, 111], 560, 0, 8, (800, 1000)),
            look_at([0, 0, 111], 560, 130, 20, (800, 1000)),
        ],
    )  # fmt: skip


def _tank() -> Example:
    side = look_at([0, 0, 85], 780, 0, 8, (1200, 700))
    above = look_at([0, 0, 85], 780, 0, 88, (1200, 700))
    return Example(
        view=side,
        lasso=[
            (250, 395), (420, 320), (600, 265), (800, 250), (915, 310), (940, 420), (880, 500),
            (700, 525), (500, 500), (320, 490),
        ],
        pulls=[
            Pull(
                view=side,
                source=[(370, 418), (450, 405), (600, 400), (760, 395), (860, 398)],
                target_view=above,
                offsets=[(0, 0, 0), (0.28, 0, -6), (0.62, 0, 38), (0.86, 0, 14), (1, 0, 0)],
            )
        ],
        looks=[
            look_at([0, 0, 85], 780, -25, 25, (1200, 700)),
            look_at([0, 0, 85], 780, 35, 30, (1200, 700)),
            above,
        ],
    )  # fmt: skip


def _drill() -> Example:
    side = look_at([-40, 0, -80], 420, 0, 4, (900, 1000))
    front = look_at([-40, 0, -80], 420, 75, 0, (900, 1000))
    return Example(
        view=side,
        lasso=[
            (478, 394), (560, 395), (640, 408), (700, 450), (705, 600), (690, 740), (640, 790),
            (540, 792), (440, 792), (412, 770), (436, 590), (462, 420),
        ],
        through=True,
        pulls=[
            Pull(
                view=front,
                source=[(452, 450), (449, 560), (450, 640), (452, 735)],
                target_view=side,
                offsets=[(0, 0, 0), (0.5, 44, 0), (1, 0, 0)],
            ),
            Pull(
                view=front,
                source=[(452, 545), (450, 600), (451, 655)],
                target_view=side,
                offsets=[(0, 0, 0), (0.5, 28, 0), (1, 0, 0)],
                modes=75,
            ),
        ],
        looks=[
            look_at([40, 0, -75], 680, 0, 6, (900, 1000)),
            look_at([-40, 0, -80], 420, 40, 10, (900, 1000)),
            look_at([-40, 0, -80], 420, -20, 6, (900, 1000)),
        ],
    )  # fmt: skip


def _plate() -> Example:
    above = look_at([0, 0, 8], 620, -25, 48, (1200, 800))
    front = look_at([0, 0, 30], 620, 0, 4, (1200, 800))
    top = look_at([0, 0, 8], 620, 0, 89, (1200, 800))
    return Example(
        view=top,
        lasso=rounded_box(280, 195, 920, 605, power=8),
        pulls=[
            Pull(
                view=top,
                source=[(350, 402), (450, 398), (600, 400), (750, 403), (850, 399)],
                target_view=front,
                offsets=[(0, 0, 0), (0.25, 0, -80), (0.5, 0, -140), (0.75, 0, -80), (1, 0, 0)],
            )
        ],
        looks=[above, look_at([0, 0, 30], 620, 0, 15, (1200, 800))],
    )


EXAMPLES = {"vase": _vase, "tank": _tank, "drill": _drill, "plate": _plate}


def draw(name: str) -> tuple[Recipe, dict[str, Any]]:
    """Return the recipe of an example and the ink it was drawn with, as plain data."""
    example = EXAMPLES[name]()
    mesh = open_file(sample_path(name)).mesh
    recipe = Recipe(digest=mesh.digest)
    run = Run()
    lasso = through_points(example.lasso, closed=True)
    with Studio(mesh) as studio:
        roi = studio.sight(example.view).vertices_inside(lasso, example.through)
        inks = []
        for pull in example.pulls:
            edit, ink = _pulled(pull, mesh, roi, studio, run)
            inks.append(ink)
            mesh = edit.apply(mesh, run)
            recipe = recipe.with_step(edit)
    drawing = {
        "lasso": _ink(example.view, lasso),
        "strokes": inks,
        "looks": [look.to_json() for look in example.looks],
    }
    return recipe, drawing


def _pulled(
    pull: Pull, mesh: Mesh, roi: Any, studio: Studio, run: Run
) -> tuple[SketchEdit, dict[str, Any]]:
    # A few modes more than are wanted settle the level that has just as many.
    parts = decompose(mesh, roi, pull.modes + 8, run=run)
    level = parts.level_of(pull.modes)
    shown = mesh.vertices.copy()
    shown[parts.roi] = parts.surface(parts.mode_count(level))
    studio.move(shown)
    path = through_points(pull.source)
    surface = mesh.with_vertices(shown)
    faces = studio.sight(pull.view).faces_under(path)
    anchors = anchor_path(surface, faces, path, pull.view, roi)
    start = pull.target_view.project(shown[anchors])
    target_path = _departed(start, np.asarray(pull.offsets, dtype=np.float64))
    target = resample_target(shown[anchors], target_path, pull.target_view)
    edit = SketchEdit(
        roi=roi,
        level=level,
        strokes=(Stroke(anchors, pull.target_view, target),),
        options=EditOptions(),
    )
    ink = {"source": _ink(pull.view, path), "target": _ink(pull.target_view, target_path)}
    return edit, ink


def _departed(start: F64, offsets: F64) -> F64:
    """Return a smooth stroke along `start` (c, 2) that departs from it by `offsets` (q, 3)."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(start, axis=0), axis=1))])
    share = offsets[:, 0]
    points = [
        np.interp(share * length[-1], length, start[:, i]) + offsets[:, 1 + i] for i in (0, 1)
    ]
    return through_points(np.stack(points, axis=1))


def _ink(view: View, path: F64) -> dict[str, Any]:
    return {"view": view.to_json(), "path": np.round(path, 2).tolist()}


def write(name: str, folder: Path) -> Path:
    """Draw an example and write its recipe with the ink; return the file."""
    recipe, drawing = draw(name)
    data = json.loads(recipe.to_json())
    data["drawing"] = drawing
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(data, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def main() -> None:
    """Write the recipes of the examples named on the command line, or of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(EXAMPLES))
    given = parser.parse_args()
    for name in given.names or EXAMPLES:
        sys.stdout.write(f"{write(name, RECIPES)}\n")


if __name__ == "__main__":
    main()
