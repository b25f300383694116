"""Where the offer to restore lies: beside the form, whatever the size of the window."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QPushButton

from app.free_place import beside
from app.opening_plate import form_seen
from app.recovery_bar import RecoveryBar
from resources import sample_path
from tests.app.driving import picture, settled

pytestmark = pytest.mark.window
WORDS = "This was closed without saving. “tank.ply” from 08:34 can be restored (one step)."


@pytest.mark.parametrize("size", [(1100, 700), (1180, 800), (1600, 1000)])
def test_it_covers_neither_the_form_nor_what_else_lies_there(
    make_window, sphere, qtbot, artefacts: Path, size: tuple[int, int]
) -> None:
    window = make_window(sphere, size=size)
    view = window.viewport
    bar = RecoveryBar(view, lambda: form_seen(window.session, view))
    window.session.opened.connect(bar.settle)
    bar.say(WORDS, {"Restore": bar.hide, "Discard": bar.hide, "Later": bar.hide})
    window.files.open(sample_path("vase"))
    qtbot.waitUntil(lambda: window.session.document.name.startswith("vase"))
    qtbot.waitUntil(settled(window))

    def free() -> bool:
        here, form = bar.geometry(), form_seen(window.session, view)
        low, high = (here.left(), here.top()), (here.right(), here.bottom())
        on_form = ((form >= low) & (form <= high)).all(axis=1).any()
        others = any(here.intersects(one.geometry()) for one in beside(bar))
        return bool(view.rect().contains(here) and not on_form and not others)

    qtbot.waitUntil(free)
    picture(window, artefacts, f"restore {size[0]}")
    for button in bar.findChildren(QPushButton):
        assert button.width() >= button.sizeHint().width(), "no button is cut off"
