"""Symmetry, strokes put aside, silhouettes, a lasso to adjust, morphing: in a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox

from app.window import Window
from tests.app.driving import Mouse, bow, circle, picture, settled


def region(window: Window, qtbot, x: float = 0.0, y: float = 0.0, radius: float = 0.22) -> None:
    Mouse().stroke(window, circle(window.viewport, x, y, radius))
    qtbot.waitUntil(settled(window), timeout=30_000)


def curve(window: Window, qtbot, sag: float, height: float = 0.0) -> None:
    ends = (-0.12, height), (0.12, height)
    Mouse().stroke(window, bow(window.viewport, *ends))
    assert window.session.document.draft.source is not None, window.session.problem
    Mouse().stroke(window, bow(window.viewport, *ends, sag))
    qtbot.waitUntil(settled(window), timeout=30_000)


def enter(window: Window, qtbot) -> None:
    steps = len(window.session.document.recipe.steps)
    qtbot.keyClick(window.viewport, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.session.document.recipe.steps) == steps + 1, timeout=30_000)
    qtbot.waitUntil(settled(window), timeout=30_000)


def choose(box: QComboBox, data: str) -> None:
    """Choose an entry by its arrow keys, as a person would."""
    QTest.keyClick(box, Qt.Key.Key_Home)
    for _ in range(box.findData(data)):
        QTest.keyClick(box, Qt.Key.Key_Down)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_plane_of_symmetry_is_chosen(
    make_window, sphere, qtbot, artefacts: Path, theme: str
) -> None:
    window = make_window(sphere, theme)
    session, box = window.session, window.edit.symmetry
    window.edit._more._head.click()
    assert box.isVisible()
    choose(box, "x")
    assert session.symmetry == "x"
    middle = sphere.bounds.mean(axis=0)[0]
    assert session.document.draft.options.mirror == (1.0, 0.0, 0.0, middle)
    assert window.actions_table.qt["region.mirror.x"].isChecked()

    window.viewport.standard_view("front")
    qtbot.waitUntil(lambda: not window.viewport.moving)
    region(window, qtbot, x=-0.18, radius=0.1)
    roi = session.document.draft.roi
    x = sphere.vertices[roi, 0] - middle
    assert 0.4 < (x > 0).mean() < 0.6, "half of the region lies on either side"
    assert np.abs(x).min() > 2, "two parts apart from each other"
    picture(window, artefacts, f"symmetry {theme}")

    window.actions_table.trigger("region.mirror.z")
    qtbot.waitUntil(settled(window), timeout=30_000)
    assert session.symmetry == "z"
    assert box.currentData() == "z"
    choose(box, "off")
    assert session.document.draft.options.mirror == ()
