"""The commands `eigenform sweep` and `eigenform batch`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

# The engine is imported when a command runs, so that --help answers at once.
if TYPE_CHECKING:
    from app.batch.folder import Row
    from app.batch.item import Item
    from engine import Recipe


def add_commands(commands: Any) -> None:
    """Add `sweep` and `batch` to the sub-parsers of the command line."""
    sweep = commands.add_parser(
        "sweep", help="make all variants of a recipe on one mesh, with a table and a contact sheet"
    )
    sweep.add_argument("recipe", type=Path, metavar="RECIPE")
    sweep.add_argument("mesh", type=Path, metavar="MESH")
    sweep.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="NAME=FROM:TO:COUNT",
        help="a number of the recipe (level, amount, 2.level, blend, ...); may be given again",
    )
    sweep.set_defaults(run=run_sweep)
    batch = commands.add_parser("batch", help="put one recipe on many meshes")
    batch.add_argument("recipe", type=Path, metavar="RECIPE")
    batch.add_argument("meshes", type=Path, nargs="+", metavar="MESH")
    batch.add_argument(
        "--transfer",
        action="store_true",
        help="the meshes have other triangles: carry the recipe over by nearest points",
    )
    batch.add_argument(
        "--from-mesh", type=Path, metavar="MESH", help="the mesh that the recipe was made on"
    )
    batch.set_defaults(run=run_batch)
    for command in (sweep, batch):
        command.add_argument("--out", type=Path, required=True, metavar="DIR")
        command.add_argument(
            "--force", action="store_true", help="replay on a mesh that the recipe was not made on"
        )
        command.add_argument(
            "--scheduler", metavar="ADDRESS", help="a running Dask scheduler; else one is started"
        )
        command.add_argument("--workers", type=int, metavar="N", help="processes; one a core")
        command.add_argument("--format", default="ply", choices=["ply", "obj", "off", "stl"])
        command.add_argument("--no-sheet", action="store_true", help="leave out the contact sheet")


def run_sweep(given: argparse.Namespace) -> int:
    """Carry out `eigenform sweep`; return the exit code."""
    from app.batch.item import variant_items
    from app.batch.vary import Variation, combinations
    from app.headless import open_for, read_recipe

    recipe = with_steps(read_recipe(given.recipe))
    values = list(combinations([Variation.parse(text) for text in given.vary]))
    mesh = open_for(recipe, given.mesh, given.force)
    return _finish(variant_items(recipe, mesh, values, given.force), given)


def run_batch(given: argparse.Namespace) -> int:
    """Carry out `eigenform batch`; return the exit code."""
    from app.batch.folder import Row
    from app.batch.item import Item
    from app.headless import open_for, read_recipe
    from engine import EngineError, load

    recipe = with_steps(read_recipe(given.recipe))
    if given.transfer and given.from_mesh is None:
        raise EngineError(
            "To carry a recipe over, the mesh it was made on is needed. Add --from-mesh MESH."
        )
    made_on = open_for(recipe, given.from_mesh, given.force) if given.transfer else None
    items: list[Item] = []
    failed: list[Row] = []
    for path in given.meshes:
        try:
            own = recipe
            if made_on is None:
                mesh = open_for(recipe, path, given.force)
            else:
                mesh = load(path)
                from engine import transfer
                from engine.files.report import shown

                carried = transfer(recipe, made_on, mesh)
                own = carried.recipe
                print(f"{shown(path.name)}: {carried.report}", file=sys.stderr)
            text = own.to_json()
            items.append(Item(path.stem, text, mesh.vertices, mesh.faces, force=given.force))
        except EngineError as error:
            failed.append(Row(path.stem, False, "", str(error), 0.0, 0.0, ""))
    return _finish(items, given, failed)


def with_steps(recipe: Recipe) -> Recipe:
    """Return a recipe after checking that it has a step."""
    from engine import RecipeError

    if not recipe.steps:
        raise RecipeError("The recipe has no steps. Apply an edit before exporting the recipe.")
    return recipe


def _finish(items: list[Item], given: argparse.Namespace, failed: list[Row] | None = None) -> int:
    from app.batch.contact_sheet import contact_sheet
    from app.batch.folder import process, write_table
    from engine.files.report import shown

    try:
        rows = process(
            items, given.out, given.scheduler, given.workers, given.format, progress=_show_progress
        )
    finally:
        # What is said next begins on a line of its own, below the bar.
        print(file=sys.stderr)
    rows += failed or []
    if failed:
        write_table(rows, given.out)
    good = [row for row in rows if row.ok]
    if good and not given.no_sheet:
        contact_sheet(good, given.out)
    print(f"{len(good)} of {len(rows)} done, in {given.out}")
    for row in rows:
        if not row.ok:
            print(f"{shown(row.name)}: {row.reason}", file=sys.stderr)
    return 0 if len(good) == len(rows) else 1


def _show_progress(done: int, total: int, name: str) -> None:
    width = 30
    filled = width * done // max(total, 1)
    bar = "#" * filled + "." * (width - filled)
    print(f"\r[{bar}] {done} of {total} {name[:40]:<40}", end="", file=sys.stderr, flush=True)
