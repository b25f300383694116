"""What was asked to be written is written: nothing pushes it aside, and closing waits for it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from shiboken6 import isValid

from app.window import Window
from engine import Mesh, load
from tests.app.driving import settled, soon

pytestmark = pytest.mark.window


@pytest.fixture
def held(make_window, sphere: Mesh, tmp_path: Path) -> Iterator[tuple[Window, threading.Event]]:
    """A window whose engine is kept busy until the event is set."""
    window = make_window(sphere)
    window.keep_safe(tmp_path / "state")
    release = threading.Event()
    window.session.jobs.submit(
        "held", lambda _run: release.wait(60), lambda _result: None, window.session.problems.report
    )
    yield window, release
    release.set()
    if isValid(window):
        window.safety.leave()


def test_neither_another_file_nor_an_opening_pushes_an_export_aside(
    held: tuple[Window, threading.Event], sphere: Mesh, sphere_file: Path, tmp_path: Path, qtbot
) -> None:
    window, release = held
    paths = [tmp_path / name for name in ("a.ply", "b.obj", "c.eigenform", "d.eigenform")]
    for path in paths[:2]:
        window.files.export(path)
    for path in paths[2:]:
        window.documents.save_to(path)
    window.files.open(sphere_file)
    release.set()
    qtbot.waitUntil(settled(window))
    qtbot.waitUntil(lambda: not window.session.writing.busy)
    assert all(path.is_file() for path in paths)
    assert (load(paths[0]).vertices == sphere.vertices).all()


def test_the_window_closes_when_all_is_written(
    held: tuple[Window, threading.Event], sphere: Mesh, tmp_path: Path, qtbot
) -> None:
    window, release = held
    path = tmp_path / "late.ply"
    window.files.export(path)
    window.close()
    assert window.isVisible(), "it waits"
    assert "late.ply" in window.hint.text
    release.set()
    qtbot.waitUntil(lambda: not isValid(window))
    assert (load(path).vertices == sphere.vertices).all()


def test_closing_again_does_not_wait(held: tuple[Window, threading.Event], tmp_path: Path) -> None:
    window, release = held
    path = tmp_path / "never.ply"
    path.write_text("what was there before")
    window.files.export(path)
    window.close()
    threading.Timer(0.2, release.set).start()
    window.close()
    assert not window.isVisible()
    assert path.read_text() == "what was there before"


def test_a_file_that_cannot_be_written_keeps_the_window_open(
    held: tuple[Window, threading.Event], tmp_path: Path, qtbot
) -> None:
    window, release = held
    window.files.export(tmp_path / "no such folder" / "lost.ply")
    window.close()
    release.set()
    assert soon(lambda: "lost.ply" in window.session.problems.sentence)
    assert window.isVisible()
    assert not window.safety.autosave.unsaved
    window.close()
    assert not window.isVisible()


def test_the_cross_stops_it_and_says_so(
    held: tuple[Window, threading.Event], tmp_path: Path, qtbot
) -> None:
    window, release = held
    path = tmp_path / "stopped.ply"
    window.files.export(path)
    cross = window.status._cross
    qtbot.waitUntil(cross.isVisible)
    assert "Writing" in window.status._words.text()
    qtbot.mouseClick(cross, Qt.MouseButton.LeftButton)
    assert "stopped.ply" in window.hint.text
    release.set()
    qtbot.waitUntil(settled(window))
    assert not window.session.writing.busy
    assert not path.exists()
