"""A window on a small bumpy sphere, with settings of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot
from shiboken6 import isValid

from app.look import Appearance
from app.window import Window
from engine import Document, Mesh, save
from tests.app.driving import bumpy_sphere, settled
from tests.app.viewport_stage import Stage, torus
from tests.program import PATIENCE

# As the program does it: before the application is made.
QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressTabletEvents, False)


class PatientBot(QtBot):
    """Waits for what happens, not for a time: however slow and busy the machine is."""

    def waitUntil(self, callback: Callable[[], bool | None], *, timeout: float = PATIENCE) -> None:
        """Wait until `callback()` holds, for so many seconds at the longest."""
        super().waitUntil(callback, timeout=round(1000 * timeout))

    def waitSignal(self, signal: Any) -> Any:
        """Wait at the end of the block until the signal came."""
        return super().waitSignal(signal, timeout=round(1000 * PATIENCE))

    def waitExposed(self, widget: QWidget) -> Any:
        """Wait at the end of the block until the widget is on the screen."""
        return super().waitExposed(widget, timeout=round(1000 * PATIENCE))


@pytest.fixture
def qtbot(qapp, request: pytest.FixtureRequest) -> PatientBot:
    """Hands on widgets, and their patience."""
    return PatientBot(request)


@pytest.fixture(autouse=True)
def _own_settings(tmp_path: Path) -> None:
    """Keep the settings of a test in its own folder."""
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(
        QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(tmp_path / "settings")
    )


@pytest.fixture(scope="session")
def sphere() -> Mesh:
    """A bumpy sphere of 3,000 vertices."""
    return bumpy_sphere()


@pytest.fixture
def sphere_file(sphere: Mesh, tmp_path: Path) -> Path:
    """The sphere as a file."""
    path = tmp_path / "sphere.ply"
    save(sphere, path)
    return path


MakeWindow = Callable[..., Window]


@pytest.fixture
def make_window(qtbot, qapp) -> Iterator[MakeWindow]:
    """Make windows that are closed after the test."""
    made: list[Window] = []

    def make(mesh: Mesh | None = None, theme: str = "dark", size=(800, 600)) -> Window:
        qapp.setApplicationName("Eigenform test")
        qapp.setOrganizationName("Eigenform test")
        window = Window(Appearance(qapp, theme))
        made.append(window)
        window.resize(*size)
        with qtbot.waitExposed(window):
            window.show()
        window.activateWindow()
        qtbot.waitUntil(window.isActiveWindow)
        qtbot.waitUntil(lambda: bool(window.viewport.render_window.GetReadyForRendering()))
        if mesh is not None:
            window.session.start(Document.open(mesh, "sphere.ply"))
            qtbot.waitUntil(settled(window))
        return window

    yield make
    for window in made:
        if isValid(window):
            window.close()


@pytest.fixture
def window(make_window: MakeWindow, sphere: Mesh) -> Window:
    """A window with the sphere open."""
    return make_window(sphere)


@pytest.fixture
def kept_safe(tmp_path: Path) -> Iterator[Callable[[Window], Window]]:
    """Have windows keep a journal in one state folder, until the end of the test."""
    safe: list[Window] = []

    def keep(window: Window) -> Window:
        window.keep_safe(tmp_path / "state")
        safe.append(window)
        return window

    yield keep
    for window in safe:
        if isValid(window):
            window.safety.leave()


@pytest.fixture
def safe_window(
    make_window: MakeWindow, kept_safe: Callable[[Window], Window], qtbot, sphere: Mesh
) -> MakeWindow:
    """Make windows with the sphere open that keep a journal."""

    def make(**given) -> Window:
        window = kept_safe(make_window(sphere, **given))
        # The program plugs safety in before anything is open.
        window.session.take_up(window.session.history, window.session.path)
        qtbot.waitUntil(settled(window))
        return window

    return make


@pytest.fixture(scope="module")
def shared_stage(qapp) -> Iterator[Stage]:
    """A viewport that the tests of a file share: to make one takes longer than most tests."""
    made = Stage(torus(6000))
    yield made
    made.close()


@pytest.fixture
def stage(shared_stage: Stage, qtbot) -> Stage:
    """The shared viewport as if it were new; qtbot catches exceptions in slots."""
    shared_stage.reset(torus(6000))
    return shared_stage
