"""Start: what the Qt application is told before a window is made."""

from __future__ import annotations

from pathlib import Path

from tests.program import run_python

ASKED = """
from app.start import application
from PySide6.QtCore import Qt
made, which = application(), Qt.ApplicationAttribute
print(made.testAttribute(which.AA_CompressHighFrequencyEvents))
print(made.testAttribute(which.AA_CompressTabletEvents))
"""


def test_every_move_of_mouse_and_pen_reaches_a_stroke(tmp_path: Path) -> None:
    # A process of its own: the platform has its say only while an application is made, and then
    # merges the moves that come while the window is busy. A fifth of a lasso was lost so.
    said = run_python("-c", ASKED, cwd=tmp_path)
    assert said.stdout.split() == ["False", "False"]
