"""Another theme: widgets take it some in each turn of the loop, and are shown in it at once."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QCheckBox

pytestmark = pytest.mark.window


def panels(window):
    """The pictures of two panels, full of buttons, fields and sliders."""
    return window.level.grab().toImage(), window.edit.grab().toImage()


def test_a_window_that_changes_its_theme_looks_like_one_made_in_it(make_window, qtbot):
    changed = make_window(theme="dark")
    dark = panels(changed)
    changed.appearance.choose("light")
    qtbot.waitUntil(lambda: not changed.appearance.restyling)
    light = panels(changed)
    assert all(a != b for a, b in zip(dark, light, strict=True))
    assert list(light) == list(panels(make_window(theme="light")))


def test_nothing_is_painted_in_two_themes(make_window, qtbot):
    window = make_window(theme="dark")
    window.appearance.choose("light")
    assert window.appearance.restyling
    assert not window.updatesEnabled()
    window.appearance.choose("dark")  # before the first was done
    qtbot.waitUntil(lambda: not window.appearance.restyling)
    assert window.updatesEnabled()
    assert window.appearance.theme.name == "dark"


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_what_is_ticked_stands_out(make_window, qtbot, theme: str) -> None:
    window = make_window(theme=theme)
    box = QCheckBox("On", window)
    unticked = box.sizeHint()
    box.setChecked(True)
    assert box.sizeHint() == unticked, "its words have room either way"
    picture = box.grab().toImage()
    seen = {
        picture.pixelColor(x, y).name()
        for x in range(picture.width() // 2)
        for y in range(picture.height())
    }
    assert window.appearance.theme.accent in seen
    assert window.appearance.theme.accent_text in seen, "and the tick in it"
