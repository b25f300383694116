"""Files: what was repaired, what can be restored, what was opened lately."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt

from engine import Mesh, load, save
from resources import sample_path
from tests.pictures.region import RIBS
from tests.pictures.studio import Stage


def faulty(mesh: Mesh, path: Path) -> None:
    """Write a mesh as an OBJ file with faults: double faces, an empty one, a loose scrap."""
    top = mesh.vertices.max(axis=0)
    scrap = top + np.array([[5.0, 0, 5], [9, 0, 5], [5, 4, 5]])
    vertices = np.concatenate([mesh.vertices, scrap])
    faces = np.concatenate([mesh.faces, mesh.faces[:40], [[7, 7, 8]], [mesh.n + np.arange(3)]])
    lines = [f"v {x:.6f} {z:.6f} {-y:.6f}" for x, y, z in vertices]  # y is up in OBJ files
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def files(stage: Stage) -> None:
    """A faulty file is opened; unsaved work is left, offered again and asked about."""
    window = stage.window
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        window.keep_safe(folder / "state")
        faulty(load(sample_path("plate")), folder / "cover.obj")
        stage.open(folder / "cover.obj")
        stage.keep("files-report")
        stage.click(window.plate.buttons["Good"])
        small = load(sample_path("drill"))
        save(small.with_vertices(small.vertices / 1000), folder / "drill.ply")
        stage.open(folder / "drill.ply")
        stage.keep("files-unit")
        stage.open("tank")
        stage.stroke(stage.shares(RIBS, closed=True))
        stage.rest()
        stage.click(window.rail.buttons["inflate"])
        stage.rest()
        steps = len(window.session.document.recipe.steps)
        stage.press(Qt.Key.Key_Return)
        stage.until(lambda: len(window.session.document.recipe.steps) > steps)
        stage.rest()
        stage.open("vase")
        stage.menu("File", "recent")
        stage.keep("files-recent")
        stage.close_menus()
        stage.key("file.restore")
        stage.until(window.safety.bar.isVisible)
        stage.keep("files-restore")
        stage.click(window.safety.bar.buttons["Restore"])
        stage.rest()
        window.close()
        stage.dialog("files-closing")
        window.safety.leave()
