"""A separate distribution, really installed with pip, works in the window and in replay."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDoubleSpinBox

from engine import Recipe, UnknownStep
from plugins import registry
from plugins.registry import find_tools, kinds
from tests.app.driving import Mouse, picture, settled
from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder that pip installed the plugin into."""
    folder = tmp_path_factory.mktemp("plugin")
    source, target = folder / "source", folder / "site"
    shutil.copytree(ROOT / "tests" / "third_party_plugin", source)
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "--disable-pip-version-check"]
    done = subprocess.run(
        [*command, "--target", str(target), str(source)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return target


@pytest.fixture
def plugin(installed: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The plugin can be imported."""
    monkeypatch.syspath_prepend(str(installed))
    importlib.invalidate_caches()
    registry._installed.cache_clear()
    yield installed
    registry._installed.cache_clear()
    sys.modules.pop("eigenform_nudge", None)


def nudge(window, qtbot, drag: tuple[float, float]) -> None:
    view = window.viewport
    middle = np.array([view.width() / 2, view.height() / 2])
    Mouse().stroke(window, [middle + np.array(drag) * t for t in np.linspace(0, 1, 12)])
    qtbot.waitUntil(settled(window))


def test_it_edits_in_the_window_and_replays_to_the_same_bytes(
    plugin: Path, make_window, qtbot, sphere_file: Path, tmp_path: Path, artefacts: Path
) -> None:
    window = make_window()
    session = window.session
    window.files.open(sphere_file)
    qtbot.waitUntil(lambda: session.document is not None)
    first = session.document
    assert [str(failure) for failure in window.failures] == [
        "The tool “absent” of eigenform-nudge was left out: "
        "AttributeError: module 'eigenform_nudge' has no attribute 'Absent'"
    ]

    qtbot.keyClick(window.viewport, Qt.Key.Key_J)
    assert window.toolhost.active.title == "Nudge"
    qtbot.keyClick(window.viewport, Qt.Key.Key_L)
    assert window.toolhost.active.title == "Lasso", "a key that is taken stays with who has it"
    assert window.actions_table.keys("tool.clumsy") == ()
    qtbot.keyClick(window.viewport, Qt.Key.Key_J)
    radius = window.strip.findChild(QDoubleSpinBox, "option radius")
    radius.setValue(25.0)
    window.viewport.setFocus()
    nudge(window, qtbot, (0.0, -60.0))
    document = session.document
    (step,) = document.recipe.steps
    assert (step.kind, step.radius) == ("nudge", 25.0)
    moved = document.mesh.vertices[step.centre] - first.mesh.vertices[step.centre]
    seen = window.viewport.view().project(document.mesh.vertices[step.centre])
    before = window.viewport.view().project(first.mesh.vertices[step.centre])
    assert np.linalg.norm(moved) > 1
    assert (seen - before)[0] == pytest.approx([0.0, -60.0], abs=1.5)
    picture(window, artefacts, "nudged")

    exported, recipe, again = (tmp_path / n for n in ("window.ply", "edit.json", "replay.ply"))
    window.files.export(exported)
    qtbot.waitUntil(lambda: not session.writing.busy)
    window.files.export_recipe(recipe)
    qtbot.waitUntil(recipe.exists)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(plugin), str(ROOT)])}
    command = [sys.executable, "-m", "app", "replay", str(recipe), str(sphere_file), str(again)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, cwd=tmp_path, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr
    assert exported.read_bytes() == again.read_bytes()

    qtbot.keyClick(window.viewport, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert session.document is first


def test_a_tool_that_raises_is_named_and_the_document_stays(
    plugin: Path, make_window, qtbot, sphere, artefacts: Path
) -> None:
    window = make_window(sphere)
    first = window.session.document
    window.toolhost.choose("clumsy")
    nudge(window, qtbot, (30.0, 0.0))
    assert window.session.document is first
    assert not window.toolhost.in_gesture
    assert window.hint.text.startswith("The tool “Clumsy” failed and was stopped")
    assert "division by zero" in window.hint.text
    picture(window, artefacts, "raised")
    window.toolhost.choose("nudge")
    assert window.session.problems.sentence == ""


def test_without_the_plugin_its_step_is_kept_and_named(plugin: Path, tmp_path: Path) -> None:
    text = '{"eigenform": 1, "mesh": "", "steps": [{"kind": "nudge", "centre": 3}]}'
    without = {name: kind for name, kind in kinds().items() if name != "nudge"}
    recipe = Recipe.from_json(text, without)
    assert isinstance(recipe.steps[0], UnknownStep)
    assert recipe.steps[0].title == "nudge (plugin missing)"
    assert "nudge" in find_tools().items
