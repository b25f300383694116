"""Folder: what a sweep or batch leaves, meshes and a table, and what of it is done already."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from app.batch.cluster import client, outcomes
from app.batch.item import Item, Outcome
from engine import EngineError, Mesh, save
from engine.files.place import write_file

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    ok: bool
    file: str
    reason: str
    seconds: float
    moved: float
    key: str
    values: tuple[tuple[str, float], ...] = ()


def process(
    items: Sequence[Item],
    out: Path,
    scheduler: str | None = None,
    workers: int | None = None,
    extension: str = "ply",
    progress: Progress | None = None,
) -> list[Row]:
    """Work through `items` into the folder `out` and return the rows of the table, in their order.

    Items that an earlier run finished in the same folder are not done again. One that fails stops
    nothing; its row has the reason. The table (`table.csv`, `table.json`) is written at the end.

    Raises
    ------
    EngineError
        The folder cannot be written, two items have one name, or there is no cluster.
    """
    names = [item.name for item in items]
    if len(set(names)) != len(names):
        twice = sorted({n for n in names if names.count(n) > 1})
        raise EngineError(f"Two results would be called {twice[0]}. Rename one of the files.")
    try:
        (out / "items").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EngineError(
            f"The folder {out} cannot be made ({error.strerror}). Choose another with --out."
        ) from error
    rows = {item.name: row for item in items if (row := _finished(item, out)) is not None}
    todo = [item for item in items if item.name not in rows]
    say = progress or _silent
    say(len(rows), len(items), "")
    if todo:
        with client(scheduler, workers) as dask_client:
            for item, outcome in outcomes(dask_client, todo):
                rows[item.name] = _keep(item, outcome, out, extension)
                say(len(rows), len(items), item.name)
    ordered = [rows[n] for n in names]
    write_table(ordered, out)
    return ordered


def _silent(done: int, total: int, name: str) -> None:
    """Show no progress."""


def _note(item_name: str, out: Path) -> Path:
    return out / "items" / f"{item_name}.json"


def _finished(item: Item, out: Path) -> Row | None:
    """Return the row of an item that is done already with the same recipe, mesh and values."""
    try:
        data = json.loads(_note(item.name, out).read_text(encoding="utf-8"))
        row = Row(**{**data, "values": tuple((n, float(v)) for n, v in data["values"])})
    except (OSError, ValueError, TypeError, KeyError):
        return None
    if not row.ok or row.key != item.key or not (out / row.file).is_file():
        return None
    return row


def _keep(item: Item, outcome: Outcome, out: Path, extension: str) -> Row:
    """Write the mesh of an outcome, then its note; a kill in between does the item again."""
    reason = outcome.reason
    file = f"{item.name}.{extension}"
    if outcome.vertices is not None and outcome.faces is not None:
        try:
            save(Mesh(outcome.vertices, outcome.faces), out / file)
        except EngineError as error:
            reason = str(error)
    ok = not reason
    row = Row(
        item.name,
        ok,
        file if ok else "",
        reason,
        round(outcome.seconds, 3),
        outcome.moved,
        item.key,
        item.values,
    )
    _write_text(_note(item.name, out), json.dumps(asdict(row), indent=1))
    return row


def write_table(rows: Iterable[Row], out: Path) -> None:
    """Write `table.csv` for people and `table.json` for programs."""
    rows = list(rows)
    _write_text(out / "table.json", json.dumps([asdict(r) for r in rows], indent=1))
    varied = [n for n, _ in rows[0].values] if rows else []
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(["name", *varied, "ok", "file", "largest move", "seconds", "reason"])
    for r in rows:
        numbers: list[Any] = [v for _, v in r.values]
        writer.writerow([r.name, *numbers, r.ok, r.file, r.moved, r.seconds, r.reason])
    _write_text(out / "table.csv", text.getvalue())


def _write_text(path: Path, text: str) -> None:
    # A file name may hold bytes that are no text.
    write_file(path, text.encode("utf-8", "backslashreplace"))
