"""The README's examples do what they say: a plugin in 20 lines, and an edit from a script."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from engine import Document, Recipe, replay
from plugins.dropin import switch
from plugins.registry import find_steps, find_tools
from resources import EXAMPLES
from tests.plugins.flat import FlatContext, do, line, plate
from tests.program import run_python


@pytest.fixture
def dropped_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The example plugin in a drop-in folder, switched on."""
    monkeypatch.setenv("EIGENFORM_PLUGINS", str(tmp_path))
    text = (EXAMPLES / "plugin_in_20_lines.py").read_text(encoding="utf-8")
    (tmp_path / "push.py").write_text(text, encoding="utf-8")
    switch("push", True)


def test_the_plugin_has_twenty_lines() -> None:
    tree = ast.parse((EXAMPLES / "plugin_in_20_lines.py").read_text(encoding="utf-8"))
    statements = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.stmt) and not isinstance(node, ast.Import | ast.ImportFrom)
    ]
    assert len(statements) - 1 <= 22, "the docstring is none of them"


def test_the_plugin_is_a_whole_tool(dropped_in: None) -> None:
    tools, steps = find_tools(), find_steps()
    assert tools.failures == steps.failures == ()
    context = FlatContext(Document.open(plate()))
    step = do(tools.items["push"], context, line((0, 0), (20, 0)))
    assert len(context.previews) > 5, "the form follows the hand"
    mesh = context.document.mesh
    text = Recipe(digest=mesh.digest).with_step(step).to_json()
    again = replay(Recipe.from_json(text, steps.items), mesh)
    moved = again.vertices - mesh.vertices
    assert moved[step.centre] == pytest.approx([0, 0, -4.0])
    away = np.linalg.norm(mesh.vertices - mesh.vertices[step.centre], axis=1)
    assert (moved[away >= 15] == 0).all()
    assert (moved[away < 14, 2] < 0).all()
    context.pick = lambda x, y: None
    assert do(tools.items["push"], context, line((0, 0), (20, 0))) is None


def test_the_script_reshapes_the_vase_and_makes_a_picture(tmp_path: Path) -> None:
    picture = tmp_path / "vase.png"
    script = EXAMPLES / "script_ten_lines.py"
    done = run_python("-W", "error", str(script), str(picture), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    both = np.asarray(Image.open(picture).convert("L"), dtype=float)
    before, after = both[:, :900], both[:, 900:]
    # To the right of the vase's belly there was background, and now there is form.
    assert np.abs(after - before)[380:560, 600:660].mean() > 15
    assert np.abs(after - before)[:, :400].mean() < 2, "the other side is as it was"
