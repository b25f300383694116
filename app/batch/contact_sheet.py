"""Contact sheet: one picture with every variant, seen from the same place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from app.batch.folder import Row
from app.pictures import Studio, sheet, write_picture
from engine import Mesh, View, load
from engine.view import look_at

CELL = (360, 360)
MOST_PICTURES = 100


def contact_sheet(rows: Sequence[Row], out: Path) -> Path:
    """Write `contact-sheet.png` with a picture of each row's mesh and return its path.

    All variants of a sweep are seen from the same place, so that the eye finds what differs; the
    members of a family each fill their cell. Beyond `MOST_PICTURES` rows an even choice is drawn.
    """
    stride = -(-len(rows) // MOST_PICTURES)
    chosen = rows[::stride]
    pictures: list[tuple[str, Image.Image]] = []
    view: View | None = None
    for row in chosen:
        mesh = load(out / row.file)
        view = view if view is not None and row.values else framed(mesh)
        with Studio(mesh) as studio:
            pictures.append((caption(row), studio.picture(view)))
    columns = min(5, max(1, round(len(pictures) ** 0.5 + 0.4)))
    whole = sheet(pictures, columns, CELL, f"{len(rows)} variants" if len(rows) > 1 else "")
    path = out / "contact-sheet.png"
    write_picture(whole, path)
    return path


def caption(row: Row) -> str:
    """Return the words below a picture: the values, or the name where nothing was varied."""
    return ", ".join(f"{name} {value:.4g}" for name, value in row.values) or row.name


def framed(mesh: Mesh) -> View:
    """Return a three-quarter view in which a mesh fills its cell."""
    low, high = mesh.bounds
    return look_at((low + high) / 2, 1.9 * mesh.diagonal, 30.0, 18.0, CELL)
