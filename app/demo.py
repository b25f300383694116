"""Redoes the paper's examples from their recipes: a picture of every stage, and a report."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from app.headless import open_for, sketch_figures, write_json
from app.pictures import Curve, Ink, Studio, sheet, write_picture
from engine import F64, I64, FileError, Mesh, Recipe, Run, SketchEdit, View, save
from engine.files.place import write_file
from plugins.registry import kinds
from resources import sample_path

FIGURES = {"vase": "12", "tank": "13", "drill": "14", "plate": "11"}
RECIPES = Path(str(files("resources") / "recipes"))
LETTERS = "abcdefghijklmnopqrstuvwxyz"


@dataclass(frozen=True, eq=False)
class Drawn:
    """An example: its recipe, and the ink that was drawn when it was made."""

    recipe: Recipe
    text: str
    lasso: Ink
    lasso_view: View
    strokes: list[dict[str, tuple[View, Ink]]]
    looks: list[View]


@dataclass(eq=False)
class Album:
    """The pictures of one example, numbered in the order they were taken."""

    folder: Path
    pictures: list[tuple[str, Image.Image]] = field(default_factory=list)

    def add(self, caption: str, picture: Image.Image) -> Path:
        """Keep a picture and write it; return its file."""
        self.pictures.append((caption, picture))
        name = "".join(c if c.isalnum() else "-" for c in caption.lower()).strip("-")
        path = self.folder / f"{len(self.pictures):02d}-{name}.png"
        write_picture(picture, path)
        return path

    def write_sheet(self, title: str, columns: int) -> Path:
        """Write all pictures together as one figure; return its file."""
        lettered = [
            (f"({LETTERS[i]}) {caption}", picture)
            for i, (caption, picture) in enumerate(self.pictures)
        ]
        width, height = self.pictures[0][1].size
        scale = 560 / max(width, height)
        path = self.folder / f"figure-{title.split()[1].rstrip(':')}.png"
        cell = (round(width * scale), round(height * scale))
        write_picture(sheet(lettered, columns, cell, title), path)
        return path


def demo(name: str, folder: Path) -> Iterator[Path]:
    """Redo an example; yield each file as it is written.

    Parameters
    ----------
    name : "vase", "tank", "drill" or "plate".
    folder : where the files go; it is made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            f"The folder {folder} cannot be made: {error.strerror}. Choose another with --out."
        ) from error
    drawn = read_example(name)
    mesh = original = open_for(drawn.recipe, sample_path(name), force=False)
    run = Run()
    report: dict[str, Any] = {"example": name, "figure": FIGURES[name], "steps": []}
    with Studio(mesh) as studio:
        album = Album(folder)
        yield album.add("The model", studio.picture(drawn.looks[0], mesh.vertices))
        first = drawn.recipe.steps[0]
        assert isinstance(first, SketchEdit)
        yield album.add(
            "The region, by lasso",
            studio.picture(drawn.lasso_view, region=first.roi, inks=[drawn.lasso]),
        )
        for edit, strokes in zip(drawn.recipe.steps, drawn.strokes, strict=True):
            assert isinstance(edit, SketchEdit)
            yield from _stages(edit, strokes, mesh, studio, album, drawn.looks, run)
            changed = edit.apply(mesh, run)
            report["steps"].append(sketch_figures(edit, mesh, changed, run))
            mesh = changed
        for look in drawn.looks:
            yield album.add("The result", studio.picture(look, mesh.vertices))
        if name != "plate":
            yield album.write_sheet(f"Fig. {FIGURES[name]}: the {name}", 4)
    if name == "plate":
        from app.demo_plate import plate_figures

        yield from plate_figures(first, original, folder, report, run)
    yield from _written(name, folder, mesh, drawn, report)


def read_example(name: str) -> Drawn:
    """Return a shipped example."""
    text = (RECIPES / f"{name}.json").read_text(encoding="utf-8")
    drawing = json.loads(text)["drawing"]
    lasso_view, lasso = _ink(drawing["lasso"], "region", closed=True)
    return Drawn(
        recipe=Recipe.from_json(text, kinds()),
        text=text,
        lasso=lasso,
        lasso_view=lasso_view,
        strokes=[
            {role: _ink(one[role], role) for role in ("source", "target")}
            for one in drawing["strokes"]
        ],
        looks=[View.from_json(look) for look in drawing["looks"]],
    )


def _ink(data: dict[str, Any], role: str, closed: bool = False) -> tuple[View, Ink]:
    return View.from_json(data["view"]), Ink(np.array(data["path"]), role, closed)


def _stages(
    edit: SketchEdit,
    drawn: dict[str, tuple[View, Ink]],
    mesh: Mesh,
    studio: Studio,
    album: Album,
    looks: list[View],
    run: Run,
) -> Iterator[Path]:
    """Take the pictures of one edit, from the surface at its level to the details put back."""
    prepared = edit.prepare(mesh, run)
    result = prepared.solve(edit.strokes)
    roi, anchors = prepared.decomposition.roi, edit.strokes[0].anchors
    level = mesh.vertices.copy()
    level[roi] = prepared.decomposition.surface(prepared.k)
    source_view, source = drawn["source"]
    target_view, target = drawn["target"]
    what = "The base shape" if prepared.k == 0 else f"At {prepared.k} modes"
    yield album.add(what, studio.picture(looks[0], level, roi))
    yield album.add(
        f"{what}, with the source", studio.picture(source_view, region=roi, inks=[source])
    )
    yield album.add(
        "Its anchors",
        studio.picture(source_view, curves=[rod(level, anchors)], region=roi),
    )
    yield album.add(
        "The target, from another side",
        studio.picture(target_view, region=roi, curves=[rod(level, anchors)], inks=[target]),
    )
    bent = result.level_vertices
    yield album.add(
        "The surface follows",
        studio.picture(target_view, bent, roi, [rod(bent, anchors)]),
    )
    yield album.add("The same from the first view", studio.picture(looks[0], bent, roi))
    yield album.add("The details put back", studio.picture(target_view, result.vertices, roi))


def rod(vertices: F64, anchors: I64) -> Curve:
    """Return the source curve as it lies on the form at `vertices`."""
    return Curve(vertices[anchors], "source")


def _written(
    name: str, folder: Path, mesh: Mesh, drawn: Drawn, report: dict[str, Any]
) -> Iterator[Path]:
    result = folder / f"{name}.ply"
    save(mesh, result)
    yield result
    recipe = folder / "recipe.json"
    write_file(recipe, drawn.recipe.to_json().encode("utf-8"))
    yield recipe
    report["result"] = mesh.digest
    write_json(folder / "report.json", report)
    yield folder / "report.json"
