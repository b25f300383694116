"""A window on a screen of a given scale factor: run in a process of its own, for Qt reads it once.

    QT_SCALE_FACTOR=1.5 python -m tests.app.fine_screen 1.5 FOLDER PICTURE

Prints a line for all that is not as it should be.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from PySide6.QtCore import QSettings

from app.look import Appearance
from app.start import application
from app.window import Window
from engine import Document
from tests.app.driving import Mouse, bumpy_sphere, circle, cut, pixels, settled, soon
from tests.app.viewport_stage import Stage, check_projection, torus


def blurred(window: Window, scale: float) -> Iterator[str]:
    """Give what is not drawn at the full resolution of the screen."""
    view = window.viewport
    if window.devicePixelRatioF() != scale:
        yield f"the scale is {window.devicePixelRatioF()}"
    if abs(pixels(view).shape[0] - scale * view.height()) > 1:
        yield f"the viewport is seen {pixels(view).shape[0]} pixels high"
    whole = tuple(int(side * scale + 0.5) for side in (view.width(), view.height()))
    if view.render_window.GetSize() != whole:
        yield f"drawn in {view.render_window.GetSize()} of {whole} pixels"
    for name, button in window.rail.buttons.items():
        wide = button.icon().pixmap(button.iconSize(), scale).width()
        if wide != round(button.iconSize().width() * scale):
            yield f"the icon of {name} is {wide} pixels wide"


def main() -> int:
    """Look at the viewport alone, then at the whole window with a region chosen."""
    scale, folder, picture = float(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(folder))
    appearance = Appearance(application(), "light")
    stage = Stage(torus(6000), (401, 307))
    check_projection(stage)
    stage.close()
    window = Window(appearance)
    window.resize(800, 600)
    window.show()
    assert soon(lambda: bool(window.viewport.render_window.GetReadyForRendering()))
    window.session.start(Document.open(bumpy_sphere(1500), "sphere.ply"))
    assert soon(settled(window))
    Mouse().stroke(window, circle(window.viewport, 0, 0, 0.2))
    assert soon(lambda: settled(window)() and not window.viewport.moving)
    assert window.session.document.draft.roi is not None
    for line in (*blurred(window, scale), *cut(window)):
        print(line)
    window.grab().save(picture)
    window.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
