"""Picture files: pictures of the form that are saved, and pictures that are traced."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QBuffer, QByteArray
from PySide6.QtGui import QImage, QImageWriter
from PySide6.QtWidgets import QFileDialog, QWidget

from app.recent import last_folder
from app.seeing import PictureDialog, picture_file
from app.session import Session
from app.trace_bar import TraceBar
from app.viewport import Viewport
from engine import FileError
from engine.files.place import readable_size, write_file
from engine.files.report import shown

TRACES = "Pictures (*.png *.jpg *.jpeg *.bmp *.webp)"


class PictureFiles:
    """Saves what the viewport shows, and lays a picture over it to trace."""

    def __init__(
        self, session: Session, viewport: Viewport, trace_bar: TraceBar, window: QWidget
    ) -> None:
        self._session = session
        self._viewport = viewport
        self._trace_bar = trace_bar
        self._window = window

    def ask_save(self) -> None:
        """Let the person choose a picture's size and background, and where it goes."""
        dialog = PictureDialog(self._viewport, self._window)
        if dialog.exec() and (path := picture_file(self._window, last_folder())) is not None:
            self.save(path, dialog.size_in_pixels, dialog.transparent.isChecked())

    def save(self, path: Path, size: tuple[int, int], transparent: bool = True) -> None:
        """Write a picture of the form of `size` pixels, on nothing or on the ground."""
        image = self._viewport.render_image(size, transparent)
        target = path if path.suffix else path.with_suffix(".png")
        self._session.writing.write(
            target,
            lambda _run: write_file(target, encoded(image, target)),
            lambda _none: self._session.noticed.emit(f"Picture saved to {shown(target.name)}"),
            self._session.problems.report,
            urgent=True,
        )

    def ask_trace(self) -> None:
        """Let the person choose a picture to trace; the same again takes it away."""
        if self._viewport.overlay.backdrop is not None:
            self._trace_bar.remove()
            return
        name, _ = QFileDialog.getOpenFileName(
            self._window, "Picture to trace", last_folder(), TRACES
        )
        if name:
            self.trace(Path(name))

    def trace(self, path: Path) -> None:
        """Lay the picture in a file over the form, to trace it, once it is read."""
        self._session.jobs.submit(
            "trace",
            lambda _run: decoded(path),
            self._trace_bar.trace,
            self._session.problems.report,
            priority=1,
            urgent=True,
        )


def encoded(image: QImage, path: Path) -> bytes:
    """Return a picture as the bytes of a file of that name.

    Raises
    ------
    FileError
        The name tells no kind of picture, or this kind cannot hold one of that size.
    """
    name, kind = shown(path.name), path.suffix[1:].lower().encode("ascii", "replace")
    if kind not in {bytes(one.data()) for one in QImageWriter.supportedImageFormats()}:
        raise FileError(f"{name} names no kind of picture. Choose a name that ends in .png.")
    buffer = QBuffer()
    buffer.open(QBuffer.OpenModeFlag.WriteOnly)
    if not QImageWriter(buffer, QByteArray(kind)).write(image):
        raise FileError(
            f"{name} cannot hold a picture of {image.width()} × {image.height()} pixels. "
            "Choose a name that ends in .png."
        )
    return bytes(buffer.data().data())


def decoded(path: Path) -> QImage:
    """Return the picture in a file.

    Raises
    ------
    FileError
        It cannot be read, or holds no picture.
    """
    # A pipe that is opened here would hold the thread up for ever.
    readable_size(path)
    image = QImage(str(path))
    if image.isNull():
        raise FileError(f"{shown(path.name)} is not a picture. Choose a PNG or JPEG file.")
    return image
