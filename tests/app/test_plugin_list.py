"""The list of plugins: reasons, switches, and another try for a tool that was switched off."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QLabel, QPushButton

from app.plugin_list import PluginList
from plugins.dropin import dropins, switch
from resources import EXAMPLES
from tests.app.driving import Mouse

pytestmark = pytest.mark.window

BROKEN = "raise ImportError('no module named antigravity')\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A drop-in folder with a good file, off, and a broken one, on."""
    there = tmp_path / "plugins"
    there.mkdir()
    monkeypatch.setenv("EIGENFORM_PLUGINS", str(there))
    (there / "good.py").write_text((EXAMPLES / "plugin_in_20_lines.py").read_text())
    (there / "broken.py").write_text(BROKEN)
    switch("broken", True)
    return there


def shown(dialog: PluginList) -> str:
    return "\n".join(label.text() for label in dialog.findChildren(QLabel))


def test_what_failed_is_listed_with_its_reason_and_files_have_switches(
    folder: Path, make_window, sphere, qtbot, artefacts: Path
) -> None:
    window = make_window(sphere)
    window.actions_table.trigger("help.plugins")
    dialog = window.findChild(PluginList)
    qtbot.waitUntil(dialog.isVisible)
    text = shown(dialog)
    assert "“broken” of broken.py was left out: ImportError: no module named antigravity" in text
    for tool in window.toolbox.tools.values():
        assert tool.title in text
    assert "eigenform" in text, "who offers it"
    box = dialog.findChild(QCheckBox, "file good")
    assert not box.isChecked()
    dialog.grab().save(str(artefacts / "plugins.png"))
    qtbot.mouseClick(box, Qt.MouseButton.LeftButton, pos=box.rect().center().__class__(10, 10))
    assert {one.name: one.on for one in dropins()} == {"broken": True, "good": True}
    assert "next start" in dialog.note.text()
    dialog.close()

    again = make_window(sphere)
    assert "push" in again.toolbox.tools
    (folder / "good.py").write_text("# changed\n")
    again.show_plugins()
    dialog = again.findChild(PluginList)
    assert (
        dialog.findChild(QCheckBox, "file good").text().endswith("changed since it was switched on")
    )
    dialog.close()


def test_a_tool_that_was_switched_off_gets_another_try(make_window, sphere, qtbot) -> None:
    window = make_window(sphere)
    window.toolbox.switch_off(window.toolbox.tools["lasso"], "ValueError: bad luck")
    assert window.toolhost.active.id != "lasso"
    window.show_plugins()
    dialog = window.findChild(PluginList)
    assert "ValueError: bad luck" in shown(dialog)
    qtbot.mouseClick(dialog.findChild(QPushButton, "again lasso"), Qt.MouseButton.LeftButton)
    assert window.toolhost.available("lasso")
    assert "bad luck" not in "".join(
        label.text() for label in dialog.findChildren(QLabel) if label.isVisibleTo(dialog)
    )
    dialog.close()
    window.toolhost.choose("lasso")
    middle = (window.viewport.width() / 2, window.viewport.height() / 2)
    Mouse().stroke(window, [middle, (middle[0] + 90, middle[1]), (middle[0], middle[1] + 90)])
    assert window.session.document.draft.roi is not None
