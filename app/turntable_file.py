"""Turntable file: one turn of the form as a moving picture, frame by frame."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFileDialog, QWidget

from app.recent import last_folder
from app.seeing import PictureDialog
from app.session import Session
from app.viewport import Viewport
from app.viewport.camera import Eye
from engine import FileError, Run
from engine.files.place import write_file
from engine.files.report import shown

FRAMES = 72
FRAME_MS = 80  # hundredths, as GIF counts; a turn takes six seconds
LARGEST = 1280  # px: all frames are kept until the turn is whole
KINDS = {".webp": "WEBP", ".gif": "GIF"}
INTERRUPTED = "The turntable is not saved: the form was moved meanwhile. Save it again."


class TurntableFile:
    """Turns the form once before one's eyes, and writes what was seen.

    Each frame is one call from the event loop, so that the window stays alive. Whoever takes hold
    of the form meanwhile ends it, and nothing is written.
    """

    def __init__(self, session: Session, viewport: Viewport, window: QWidget) -> None:
        self._session = session
        self._viewport = viewport
        self._window = window
        self._frames: list[QImage] = []
        self._from: Eye | None = None
        self._expected: Eye | None = None
        self._target = Path()
        self._size, self._transparent = (1, 1), False
        self._next = QTimer(viewport)
        self._next.timeout.connect(self._take)

    @property
    def under_way(self) -> bool:
        """Whether frames are being taken."""
        return self._next.isActive()

    def ask(self) -> None:
        """Let the person choose a size and a background, and where it goes."""
        dialog = PictureDialog(
            self._viewport, self._window, "Save a turntable", largest=LARGEST, times=1
        )
        if not dialog.exec():
            return
        kinds = "WebP (*.webp);;GIF (*.gif)"
        name, _ = QFileDialog.getSaveFileName(
            self._window, "Save a turntable", last_folder(), kinds
        )
        if name:
            self.save(Path(name), dialog.size_in_pixels, dialog.transparent.isChecked())

    def save(self, path: Path, size: tuple[int, int], transparent: bool = False) -> None:
        """Begin to take the frames, of `size` pixels, on nothing or on the ground."""
        target = path if path.suffix else path.with_suffix(".webp")
        if target.suffix.lower() not in KINDS:
            self._session.problems.say(
                f"{shown(target.name)} names no kind of moving picture. "
                "Choose a name that ends in .webp or .gif."
            )
            return
        self._viewport.set_turntable(False)
        self._target, self._size, self._transparent = target, size, transparent
        self._frames = []
        self._from = self._expected = self._viewport.eye
        self._next.start(0)

    def stop(self) -> None:
        """Take no more frames, for closing."""
        self._next.stop()
        self._frames = []

    def _take(self) -> None:
        start = self._from
        assert start is not None
        if self._expected is None or not self._viewport.eye.same_as(self._expected):
            self.stop()
            self._session.problems.say(INTERRUPTED)
            return
        self._frames.append(self._viewport.render_image(self._size, self._transparent))
        turned = len(self._frames)
        angle = 2 * math.pi * turned / FRAMES
        eye = start if turned == FRAMES else start.orbited(np.zeros(3), angle, 0.0)
        self._viewport.navigation.look(eye, animate=False)
        self._expected = eye
        if turned == FRAMES:
            self._write()
        elif turned % 12 == 1:
            self._session.noticed.emit(f"Turning: {turned // 12 + 1} of {FRAMES // 12}")

    def _write(self) -> None:
        frames, target = self._frames, self._target
        self.stop()
        self._session.writing.write(
            target,
            lambda run: write_file(target, moving(frames, target, run)),
            lambda _none: self._session.noticed.emit(f"Turntable saved to {shown(target.name)}"),
            self._session.problems.report,
        )


def moving(frames: list[QImage], path: Path, run: Run) -> bytes:
    """Return frames as the bytes of a moving picture of that name, for ever from the beginning.

    Raises
    ------
    FileError
        The picture library cannot make one of that kind or size.
    """

    def each() -> Iterator[Image.Image]:
        for number, frame in enumerate(frames):
            run.tick(number / len(frames), "Turntable")
            shown = Image.fromarray(pixels(frame), "RGBA")
            # Of colours without alpha a GIF's few are chosen better, and dithered.
            opaque = shown.getchannel("A").getextrema() == (255, 255)
            yield shown.convert("RGB") if opaque else shown

    rest, out = each(), io.BytesIO()
    try:
        next(rest).save(
            out,
            KINDS[path.suffix.lower()],
            save_all=True,
            append_images=rest,
            duration=FRAME_MS,
            loop=0,
            disposal=2,  # the form before does not show through a frame on nothing
        )
    except (OSError, ValueError) as error:
        raise FileError(
            f"{shown(path.name)} could not be made ({error}). Choose a smaller size."
        ) from error
    return out.getvalue()


def pixels(image: QImage) -> NDArray[np.uint8]:
    """Return an image as RGBA, (h, w, 4), row 0 on top."""
    plain = image.convertToFormat(QImage.Format.Format_RGBA8888)
    rows = np.frombuffer(plain.constBits(), np.uint8).reshape(plain.height(), -1)
    return rows[:, : 4 * plain.width()].reshape(plain.height(), plain.width(), 4).copy()
