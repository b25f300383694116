"""File dialogs: where a person says what to open, and where things go."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from app.files import Files
from app.recent import last_folder

OPENS = "Meshes and documents (*.eigenform *.obj *.ply *.stl *.off *.3mf);;All files (*)"
EXPORTS = "PLY, exact (*.ply);;Wavefront OBJ (*.obj);;STL (*.stl);;OFF (*.off);;3MF (*.3mf)"


class FileDialogs:
    """Asks for a file and gives it to `Files`; a dialog that is closed does nothing."""

    def __init__(self, files: Files, window: QWidget) -> None:
        self._files = files
        self._window = window

    def open(self) -> None:
        """Let the person choose a file to open."""
        name, _ = QFileDialog.getOpenFileName(self._window, "Open", last_folder(), OPENS)
        if name:
            self._files.open(Path(name))

    def export(self) -> None:
        """Let the person choose where the mesh goes."""
        name, chosen = QFileDialog.getSaveFileName(
            self._window, "Export mesh", last_folder(), EXPORTS
        )
        if name:
            path = Path(name)
            if not path.suffix:
                path = path.with_suffix("." + chosen.split("*.")[1].rstrip(")"))
            self._files.export(path)

    def export_recipe(self) -> None:
        """Let the person choose where the recipe goes."""
        name, _ = QFileDialog.getSaveFileName(
            self._window, "Save recipe", last_folder(), "Recipe (*.json)"
        )
        if name:
            path = Path(name)
            self._files.export_recipe(path if path.suffix else path.with_suffix(".json"))
