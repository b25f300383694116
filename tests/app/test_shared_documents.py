"""Two windows on one document, names that look like markup, pictures that are no files."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QLabel, QMessageBox

from app.link_text import LinkText
from app.picture_files import encoded
from app.recent import recent
from app.window import Window
from engine import FileError, save
from engine.archive import open_archive
from engine.files.place import stamp_of
from plugins.registry import kinds
from tests.app.driving import settled, soon

MARKUP = '<b>bold<b> <img src="x.png">.obj'


def open_in_both(saving: Window, other: Window, path: Path, qtbot) -> None:
    """Save one window's document and open it in both."""
    with qtbot.waitSignal(saving.documents.saved):
        saving.documents.save_to(path)
    for window in (saving, other):
        with qtbot.waitSignal(window.files.unpacked):
            window.files.open(path)
        qtbot.waitUntil(settled(window))


def name_a_region(window: Window, name: str) -> None:
    session = window.session
    triangle = session.document.mesh.faces[0]
    session.change(session.document.with_region(name, triangle), "Region")


def refused_to_save_over(window: Window, path: Path, qtbot) -> None:
    """Save what another window has changed: it is said, and the file stays as it is."""
    window.documents.save()
    qtbot.waitUntil(lambda: bool(window.session.problems.sentence))
    assert "another window or program has changed the file" in window.session.problems.sentence
    assert list(open_archive(path, kinds()).state.current.regions) == ["theirs"]


def test_a_window_does_not_save_over_what_another_one_saved(
    make_window: Callable[..., Window], sphere, qtbot, tmp_path: Path, monkeypatch
) -> None:
    path = tmp_path / "shared.eigenform"
    one, two = make_window(sphere), make_window(sphere)
    open_in_both(one, two, path, qtbot)
    name_a_region(one, "mine")
    name_a_region(two, "theirs")
    with qtbot.waitSignal(two.documents.saved):
        two.documents.save()
    with qtbot.waitSignal(two.documents.saved):
        two.documents.save()
    refused_to_save_over(one, path, qtbot)
    # Asked for by name, it replaces it, and from then on it is its own.
    monkeypatch.setattr(
        "app.documents.QFileDialog.getSaveFileName", lambda *_given: (str(path), "")
    )
    with qtbot.waitSignal(one.documents.saved):
        one.documents.save_as()
    assert list(open_archive(path, kinds()).state.current.regions) == ["mine"]
    with qtbot.waitSignal(one.documents.saved):
        one.documents.save()


def test_restored_work_is_not_saved_over_what_another_window_saved(
    make_window: Callable[..., Window], sphere, qtbot, tmp_path: Path
) -> None:
    path = tmp_path / "shared.eigenform"
    killed, other = make_window(sphere), make_window(sphere)
    killed.keep_safe(tmp_path / "state")
    open_in_both(killed, other, path, qtbot)
    name_a_region(killed, "mine")
    killed.safety.autosave.end("crash")
    # Killed a second time, it is still known.
    restored: list[Window] = []
    for _ in range(2):
        window = make_window(sphere)
        restored.append(window)
        window.keep_safe(tmp_path / "state")
        bar = window.safety.bar
        qtbot.waitUntil(bar.isVisible)
        qtbot.mouseClick(bar.buttons["Restore"], Qt.MouseButton.LeftButton)
        qtbot.waitUntil(settled(window))
        assert "mine" in window.session.document.regions
        assert (window.session.path, window.session.stamp) == (path, stamp_of(path))
        window.safety.autosave.end("crash")
    again = restored[-1]
    name_a_region(other, "theirs")
    with qtbot.waitSignal(other.documents.saved):
        other.documents.save()
    refused_to_save_over(again, path, qtbot)
    for window in (killed, *restored):
        window.safety.leave()


@pytest.mark.parametrize("content", ["nothing", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n"])
def test_a_name_that_looks_like_markup_is_shown_as_it_is(
    content: str, make_window: Callable[..., Window], sphere, qtbot, tmp_path: Path
) -> None:
    window = make_window(sphere)
    window.keep_safe(tmp_path / "state")
    path = tmp_path / MARKUP
    path.write_text(content)
    window.files.open(path)

    def labels() -> list[QLabel]:
        return [label for label in window.findChildren(QLabel) if "<b>bold" in label.text()]

    def read() -> list[LinkText]:
        return [words for words in window.findChildren(LinkText) if MARKUP in words.text]

    qtbot.waitUntil(lambda: bool(labels() or read()))
    for label in labels():
        assert label.textFormat() == Qt.TextFormat.PlainText, label.text()
    if content != "nothing":
        qtbot.waitUntil(settled(window))
        window.safety._ask()
        question = window.safety._question
        assert isinstance(question, QMessageBox)
        assert MARKUP in question.text()
        assert question.textFormat() == Qt.TextFormat.PlainText
        question.reject()
    window.safety.leave()


@pytest.mark.skipif(sys.platform == "win32", reason="pipes are of POSIX")
def test_a_picture_is_written_whole_and_never_waited_for(
    make_window: Callable[..., Window], sphere, qtbot, tmp_path: Path
) -> None:
    window = make_window(sphere)
    problems, pictures = window.session.problems, window.picture_files
    pipe = tmp_path / "pipe.png"
    os.mkfifo(pipe)
    pictures.trace(pipe)
    assert soon(lambda: "is not an ordinary file" in problems.sentence)
    problems.clear()
    pictures.save(pipe, (40, 30))
    assert soon(lambda: "is not an ordinary file" in problems.sentence)
    assert pipe.is_fifo()
    pictures.save(tmp_path / "none" / "a.png", (40, 30))
    assert soon(lambda: "the folder is not there" in problems.sentence)
    pictures.save(tmp_path / "a.xyz", (40, 30))
    assert soon(lambda: "names no kind of picture" in problems.sentence)
    path = tmp_path / "line\nbreak.png"
    pictures.save(path, (40, 30))
    assert soon(path.exists)
    assert QImage(str(path)).width() == 40
    assert sorted(p.name for p in tmp_path.iterdir()) == ["line\nbreak.png", "pipe.png"]


@pytest.mark.qt_log_ignore("Maximum supported image dimension", extend=True)
def test_a_kind_of_picture_that_holds_no_such_size_is_refused(qapp) -> None:
    with pytest.raises(FileError, match=r"a\.jpg cannot hold a picture of 70000 × 1 pixels"):
        encoded(QImage(70_000, 1, QImage.Format.Format_RGB32), Path("a.jpg"))


@pytest.mark.skipif(sys.platform != "linux", reason="names are bytes there")
@pytest.mark.parametrize("name", [b"\xff\xfe\x80 caf\xe9", "line\nbreak, käfer".encode()])
def test_a_name_of_any_bytes_goes_through_the_window(
    name: bytes, make_window: Callable[..., Window], sphere, qtbot, tmp_path: Path
) -> None:
    window = make_window()
    window.keep_safe(tmp_path / "state")
    folder = tmp_path / os.fsdecode(name)
    folder.mkdir()
    path = folder / os.fsdecode(name + b".obj")
    save(sphere, path)
    with qtbot.waitSignal(window.session.opened):
        window.files.open(path)
    session = window.session
    session.change(session.document.with_region("part", sphere.faces[0]), "Region")
    assert window.safety.autosave.flush()
    document = path.with_suffix(".eigenform")
    with qtbot.waitSignal(window.documents.saved):
        window.documents.save_to(document)
    with qtbot.waitSignal(window.files.unpacked):
        window.files.open(document)
    qtbot.waitUntil(settled(window))
    assert session.document.name == path.name
    told: list[str] = []
    session.noticed.connect(told.append)
    exported = folder / os.fsdecode(name + b".ply")
    window.files.export(exported)
    qtbot.waitUntil(lambda: bool(told or session.problems.sentence))
    assert session.problems.sentence == ""
    assert told[-1].startswith("Exported to ")
    assert exported.is_file()
    assert recent()[0] == document
    (found,) = (tmp_path / "state" / "journals").iterdir()
    assert found.stat().st_size > 1000
    window.safety.leave()
