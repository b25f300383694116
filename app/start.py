"""Start: the Qt application, and the window on a file."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

from PySide6.QtCore import QSettings, Qt, QTimer
from PySide6.QtWidgets import QApplication

from app.look import Appearance
from app.places import state_folder
from app.settings_file import step_round_bad_settings
from app.window import Window
from engine import start_worker
from resources import sample_path

NAME = "Eigenform"


def application() -> QApplication:
    """Return the Qt application, made the way the viewport needs it."""
    existing = QApplication.instance()
    if isinstance(existing, QApplication):
        return existing
    made = QApplication(sys.argv[:1])
    # Every point that mouse and pen report is wanted: strokes are drawn with them. The platforms
    # switch this on again while the application is made, so it is switched off only now.
    made.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
    made.setAttribute(Qt.ApplicationAttribute.AA_CompressTabletEvents, False)
    made.setApplicationName(NAME)
    made.setOrganizationName(NAME)
    # What the program is made of never goes. To look for garbage among these 250,000 objects too
    # would hold up the window for 90 ms, whichever thread does it.
    gc.collect()
    gc.freeze()
    return made


def main(path: Path | None = None) -> int:
    """Open the window on a file, or on the sample vase, and run until it is closed."""
    app = application()
    settings_fault = step_round_bad_settings(NAME, NAME)
    choice = QSettings().value("look/theme", "system")
    window = Window(Appearance(app, str(choice)))
    window.keep_safe(state_folder())
    start_worker()
    window.show()
    if path is None:
        window.session.opened.connect(window.welcome.begin, Qt.ConnectionType.SingleShotConnection)
    if settings_fault:
        window.session.opened.connect(
            # To open a document clears what was said before.
            lambda: QTimer.singleShot(0, lambda: window.session.problems.say(settings_fault)),
            Qt.ConnectionType.SingleShotConnection,
        )
    QTimer.singleShot(0, lambda: window.files.open(path or sample_path("vase")))
    return app.exec()
