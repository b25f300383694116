"""Steps and variants by mouse and keys: going back, branching, naming, comparing, flipping."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QMenu, QPushButton, QTreeWidgetItem

from app.window import Window
from engine import Mesh
from tests.app.driving import Mouse, bow, circle, picture, pixels, press, settled, soon

LEFT, MIDDLE = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton
NONE = Qt.KeyboardModifier.NoModifier


def step(window: Window, qtbot, sag: float) -> int:
    """Circle, draw, draw again, Enter; return the moment."""
    session, view = window.session, window.viewport
    steps = len(session.document.recipe.steps)
    Mouse().stroke(window, circle(view, 0, 0, 0.2))
    qtbot.waitUntil(settled(window))
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0)))
    Mouse().stroke(window, bow(view, (-0.1, 0.0), (0.1, 0.0), sag))
    qtbot.waitUntil(settled(window))
    press(view, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(session.document.recipe.steps) == steps + 1)
    qtbot.waitUntil(settled(window))
    moment = session.history.current_id
    qtbot.waitUntil(lambda: moment in window.steps.pictures())
    return moment


def row(window: Window, words: str) -> QTreeWidgetItem:
    found = window.steps.tree.findItems(
        words, Qt.MatchFlag.MatchExactly | Qt.MatchFlag.MatchRecursive
    )
    return found[0]


def click_row(window: Window, qtbot, words: str) -> None:
    tree, item = window.steps.tree, row(window, words)
    tree.scrollToItem(item)
    qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualItemRect(item).center())
    qtbot.waitUntil(settled(window))
    assert window.steps.tree.currentItem().text(0) == words


def button(parent, words: str) -> QPushButton:
    return next(b for b in parent.findChildren(QPushButton) if b.text() == words)


def name(window: Window, qtbot, words: str, by_key: bool) -> None:
    """Name the current step, by the button or by F2 on its row."""
    tree = window.steps.tree
    if by_key:
        tree.setFocus()
        press(tree, Qt.Key.Key_F2)
    else:
        qtbot.mouseClick(window.steps.name, LEFT)
    assert soon(lambda: tree.findChild(QLineEdit) is not None)
    editor = tree.findChild(QLineEdit)
    QTest.keyClick(editor, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(editor, words)
    QTest.keyClick(editor, Qt.Key.Key_Return)
    history = window.session.history
    assert soon(lambda: history.moments[history.current_id].name == words)


def test_variants_from_the_first_branch_to_the_last_flip(
    make_window, sphere: Mesh, qtbot, artefacts: Path
) -> None:
    window = make_window(sphere, size=(1280, 800))
    session, steps = window.session, window.steps
    full = step(window, qtbot, -0.4)
    name(window, qtbot, "Full", by_key=False)

    click_row(window, qtbot, "Opened")
    assert session.history.current_id == 0
    assert (window.viewport.vertices == sphere.vertices).all(), "the form of that moment is seen"
    slim = step(window, qtbot, 0.3)
    name(window, qtbot, "Slim", by_key=True)
    assert {row(window, one).parent().text(0) for one in ("Full", "Slim")} == {"Opened"}
    for one in ("Opened", "Full", "Slim"):
        assert not row(window, one).icon(0).isNull(), "every row has its picture"
    shown = pixels(steps.tree.viewport())
    picture(window, artefacts, "tree")
    assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 200, "thumbnails are seen"

    # Two side by side, from one place, whichever is turned.
    qtbot.mouseClick(steps.compare, LEFT)
    assert soon(lambda: isinstance(QApplication.activePopupWidget(), QMenu))
    menu = QApplication.activePopupWidget()
    action = next(a for a in menu.actions() if a.text() == "Full")
    place = menu.actionGeometry(action).center()
    for at in (place - QPoint(4, 0), place):
        QTest.mouseMove(menu, at)
        QTest.qWait(10)
    QTest.mouseClick(menu, LEFT, NONE, place)
    assert soon(lambda: window.compare is not None)
    here, there = window.viewport, window.compare.viewport
    qtbot.waitUntil(lambda: bool(there.render_window.GetReadyForRendering()))
    assert (there.vertices == session.history.moments[full].document.mesh.vertices).all()
    azimuth = here.eye.azimuth
    start = there.rect().center()
    QTest.mousePress(there, MIDDLE, NONE, start)
    for k in range(1, 6):
        QTest.mouseMove(there, start + QPoint(12 * k, 0))
    QTest.mouseRelease(there, MIDDLE, NONE, start + QPoint(60, 0))
    assert soon(lambda: not here.moving and not there.moving)
    assert abs(here.eye.azimuth - azimuth) > 0.1
    assert here.eye.azimuth == there.eye.azimuth
    both = [pixels(one)[100:-100, 50:-50] for one in (here, there)]
    wide = min(one.shape[1] for one in both)
    assert np.abs(both[0][:, :wide] - both[1][:, :wide]).max() > 60, "two forms"
    picture(window, artefacts, "side by side")

    qtbot.mouseClick(button(window.compare.header, "Swap"), LEFT)
    qtbot.waitUntil(settled(window))
    assert session.history.current_id == full
    assert window.compare.moment.id == slim
    qtbot.mouseClick(button(window.compare.header, "Close"), LEFT)
    assert soon(lambda: window.compare is None)

    for wanted in (slim, full):
        press(window.viewport, Qt.Key.Key_V)
        qtbot.waitUntil(settled(window))
        assert session.history.current_id == wanted
        form = session.history.moments[wanted].document.mesh.vertices
        assert (window.viewport.vertices == form).all()
