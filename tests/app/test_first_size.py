"""The window opens whole on a small screen: its hint and its status bar are below the form."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QSize

from app.window import FIRST_SIZE, Window, first_size


@pytest.mark.parametrize("screen", [(1280, 800), (1366, 768), (1024, 740), (1920, 1080)])
def test_the_first_window_and_its_frame_fit_on_the_screen(screen: tuple[int, int]) -> None:
    size = first_size(QSize(*screen))
    assert size.width() < screen[0]
    assert size.height() <= screen[1] - 40, "a title bar has room above it"
    assert size.width() >= screen[0] - 20 or size.width() == FIRST_SIZE.width()


def test_a_large_screen_does_not_make_it_larger() -> None:
    assert first_size(QSize(3840, 2160)) == FIRST_SIZE


@pytest.mark.window
def test_a_window_begins_so(make_window, monkeypatch) -> None:
    asked: list[tuple] = []
    resize = Window.resize

    def told(window: Window, *size: object) -> None:
        asked.append(size)
        resize(window, *size)

    monkeypatch.setattr(Window, "resize", told)
    window = make_window()
    assert asked[0] == (first_size(window.screen().availableSize()),)
