"""What every test is held to: no stray warning, log record, thread or VTK window outlives it."""

from __future__ import annotations

import gc
import logging
import os
import select
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import plugins.importing
from tests import comma_locale
from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[1]
OURS = ("app", "engine", "plugins", "resources")
# Threads that belong to libraries and live as long as the process.
LASTING_THREADS = (
    "pytest_timeout",
    "file-worker",
    "Dask-Offload",
    "Dummy-",
    "execnet",
    "pydevd",
    "QThread",
    "tokio",
)

# Every machine tries the same examples, and none is told to be too slow for them.
settings.register_profile(
    "the same everywhere",
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("the same everywhere")
plugins.importing.SECONDS = PATIENCE

_locale = ""
_xvfb: subprocess.Popen[bytes] | None = None


def pytest_report_header() -> list[str]:
    """Say which locale the tests run under, if one was asked for."""
    return [_locale] if _locale else []


def pytest_configure(config: pytest.Config) -> None:
    """Enter the wanted locale, and give each parallel worker a screen of its own.

    So none takes another's focus.
    """
    global _locale, _xvfb
    _locale = comma_locale.enter(ROOT / "build" / "locales")
    parallel = "PYTEST_XDIST_WORKER" in os.environ
    if not parallel or not sys.platform.startswith("linux") or shutil.which("Xvfb") is None:
        return
    reader, writer = os.pipe()
    command = [
        "Xvfb",
        "-displayfd",
        str(writer),
        "-screen",
        "0",
        "1600x1200x24",
        "-nolisten",
        "tcp",
    ]
    _xvfb = subprocess.Popen(command, pass_fds=[writer], stderr=subprocess.DEVNULL)
    os.close(writer)
    with os.fdopen(reader) as answer:
        if not select.select([answer], [], [], PATIENCE)[0]:
            _xvfb.kill()
            raise pytest.UsageError(f"Xvfb has not said within {PATIENCE} s what it serves.")
        number = answer.readline().strip()
    if number:
        os.environ["DISPLAY"] = f":{number}"
        os.environ.pop("XAUTHORITY", None)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Stop this worker's screen."""
    if _xvfb is not None:
        _xvfb.terminate()
        _xvfb.wait(PATIENCE)


@pytest.fixture(scope="session")
def shared_meshes() -> Path:
    """Folder of real and broken meshes beside the repository; the test is skipped without it."""
    folder = ROOT.parent / "shared" / "meshes"
    if not folder.is_dir():
        pytest.skip(f"no shared meshes beside the repository ({folder.name} is absent)")
    return folder


@pytest.fixture
def artefacts(request: pytest.FixtureRequest) -> Path:
    """Folder for pictures that a person looks at after the run; one for each test file."""
    folder = ROOT / "artefacts" / Path(str(request.path)).stem
    folder.mkdir(parents=True, exist_ok=True)
    return folder


class _Warnings(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        if record.name.split(".")[0] in OURS:
            self.records.append(record)


@pytest.fixture(autouse=True)
def _no_logged_warning(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail on a warning that our code logs, unless the test asks for `caplog` to look at it."""
    handler = _Warnings()
    logging.getLogger().addHandler(handler)
    yield
    logging.getLogger().removeHandler(handler)
    if handler.records and "caplog" not in request.fixturenames:
        lines = [f"{r.name}: {r.getMessage()}" for r in handler.records]
        pytest.fail("logged and not expected:\n" + "\n".join(lines), pytrace=False)


@pytest.fixture(autouse=True)
def _locale_stays() -> Iterator[None]:
    """Fail when a test leaves another decimal point: the tests after it would prove nothing."""
    before = comma_locale.decimal_point()
    yield
    after = comma_locale.decimal_point()
    if after != before:
        pytest.fail(f"the decimal point was “{before}” and is “{after}” now", pytrace=False)


def _threads() -> set[threading.Thread]:
    return {t for t in threading.enumerate() if not t.name.startswith(LASTING_THREADS)}


@pytest.fixture(autouse=True)
def _no_leaked_thread() -> Iterator[None]:
    """Fail when a thread that the test started does not end after it."""
    before = _threads()
    yield
    limit = time.monotonic() + PATIENCE
    while (left := _threads() - before) and time.monotonic() < limit:
        time.sleep(0.02)
        if time.monotonic() > limit - PATIENCE / 2:
            gc.collect()  # a pool whose owner is part of a cycle ends with it
    if left:
        names = ", ".join(sorted(t.name for t in left))
        pytest.fail(f"threads still running: {names}", pytrace=False)


@pytest.fixture(scope="module", autouse=True)
def _what_was_there_before() -> None:
    """Spare the collector what a file's tests find: the modules alone are 350,000 objects.

    To go through them after every test took longer than most tests do.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _no_leaked_render_window(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail when a VTK render window outlives a test that used Qt (30 MB each)."""
    if "qtbot" not in request.fixturenames:
        yield
        return
    # The test before held its window until its very end: what is left of that one goes now, or Qt
    # may make something else in its place that Python then takes for what was there.
    gc.collect()
    before = {id(one) for one in _render_windows()}
    yield
    from PySide6.QtCore import QCoreApplication, QEvent

    # Without this deleteLater never runs, because no event loop is left.
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.collect()
    left = [type(one).__name__ for one in _render_windows() if id(one) not in before]
    if left:
        pytest.fail(f"render windows outlive the test: {', '.join(left)}", pytrace=False)


def _render_windows() -> list[object]:
    vtk_core = sys.modules.get("vtkmodules.vtkRenderingCore")
    if vtk_core is None:
        return []
    kind = vtk_core.vtkRenderWindow
    return [one for one in gc.get_objects() if isinstance(one, kind)]
