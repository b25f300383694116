"""Where a file dialog begins: beside the person's own files, never in the program's folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QFileDialog

from app.places import folder_of
from app.window import Window
from resources import sample_path
from tests.app.driving import settled

pytestmark = pytest.mark.window


@pytest.fixture
def asked(monkeypatch) -> list[str]:
    """Keep what dialogs begin with; they are closed at once."""
    places: list[str] = []

    def ask(_parent, _title: str, place: str, _filter: str) -> tuple[str, str]:
        places.append(place)
        return "", ""

    monkeypatch.setattr(QFileDialog, "getSaveFileName", ask)
    return places


def opened(make_window, qtbot, path: Path) -> Window:
    """A window with a file open."""
    window = make_window()
    window.files.open(path)
    qtbot.waitUntil(lambda: window.session.document is not None)
    qtbot.waitUntil(settled(window))
    return window


def test_what_comes_of_a_sample_goes_to_the_persons_own_folder(
    make_window, qtbot, asked: list[str]
) -> None:
    window = opened(make_window, qtbot, sample_path("plate"))
    for action in ("file.save", "file.export", "file.recipe"):
        window.actions_table.trigger(action)
    assert [Path(one).parent for one in asked] == 3 * [Path.home()]


def test_what_comes_of_a_file_goes_beside_it_under_another_name(
    make_window, qtbot, asked: list[str], sphere_file: Path
) -> None:
    window = opened(make_window, qtbot, sphere_file)
    for action in ("file.save", "file.export", "file.recipe"):
        window.actions_table.trigger(action)
    names = ["sphere.eigenform", "sphere reshaped.ply", "sphere reshaped.json"]
    assert [Path(one) for one in asked] == [sphere_file.resolve().parent / name for name in names]


def test_a_folder_that_only_sounds_like_ours_is_the_persons(tmp_path: Path) -> None:
    assert folder_of(tmp_path / "resources" / "meshes" / "vase.ply") == (
        tmp_path.resolve() / "resources" / "meshes"
    )
