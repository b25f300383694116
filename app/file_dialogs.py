"""File dialogs: where a person says what to open, and where things go."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from app.files import Files
from app.recent import last_folder
from app.session import Session

OPENS = "Meshes and documents (*.eigenform *.obj *.ply *.stl *.off *.3mf);;All files (*)"
EXPORTS = "PLY, exact (*.ply);;Wavefront OBJ (*.obj);;STL (*.stl);;OFF (*.off);;3MF (*.3mf)"


class FileDialogs:
    """Asks for a file and gives it to `Files`; a dialog that is closed does nothing."""

    def __init__(self, session: Session, files: Files, window: QWidget) -> None:
        self._session = session
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
            self._window, "Export mesh", self._suggested(".ply"), EXPORTS
        )
        if name:
            path = Path(name)
            if not path.suffix:
                path = path.with_suffix("." + chosen.split("*.")[1].rstrip(")"))
            self._files.export(path)

    def export_recipe(self) -> None:
        """Let the person choose where the recipe goes."""
        name, _ = QFileDialog.getSaveFileName(
            self._window, "Save recipe", self._suggested(".json"), "Recipe (*.json)"
        )
        if name:
            path = Path(name)
            self._files.export_recipe(path if path.suffix else path.with_suffix(".json"))

    def _suggested(self, suffix: str) -> str:
        """Return a place for what comes of the document: its name, marked as another form."""
        document = self._session.document
        stem = Path(document.name).stem if document is not None else ""
        return str(Path(last_folder()) / f"{stem or 'untitled'} reshaped{suffix}")
