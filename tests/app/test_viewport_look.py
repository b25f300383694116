"""Colours that stay apart for everybody, readable themes, icons."""

from __future__ import annotations

import numpy as np
import pytest

from app.look import (
    DARK,
    ERROR,
    LIGHT,
    PIN,
    REGION,
    RIM,
    SOURCE,
    TARGET,
    WARNING,
    Appearance,
    icon,
    rgb,
)

MARKS = {"region": REGION, "rim": RIM, "source": SOURCE, "target": TARGET, "pin": PIN}
# Machado, Oliveira and Fernandes 2009, full severity, on linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protan": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritan": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def linear(colour: str) -> np.ndarray:
    c = np.array(rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(linear_rgb: np.ndarray) -> np.ndarray:
    xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    ) @ np.clip(linear_rgb, 0, 1)
    f = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(a: str, b: str) -> float:
    """WCAG contrast ratio."""
    high, low = sorted((linear(c) @ [0.2126, 0.7152, 0.0722] for c in (a, b)), reverse=True)
    return float((high + 0.05) / (low + 0.05))


@pytest.mark.parametrize("kind", BLINDNESS)
def test_marks_stay_apart_for_colour_blind_people(kind):
    seen = {n: lab(np.array(BLINDNESS[kind]) @ linear(c)) for n, c in MARKS.items()}
    names = list(seen)
    for i, first in enumerate(names):
        for second in names[:i]:
            assert np.linalg.norm(seen[first] - seen[second]) > 20, (first, second)


@pytest.mark.parametrize("theme", [DARK, LIGHT], ids=lambda t: t.name)
def test_text_is_readable(theme):
    for ground in (theme.window, theme.panel, theme.field):
        assert contrast(theme.text, ground) >= 7.0
        assert contrast(theme.faint, ground) >= 4.5
    assert contrast(theme.accent_text, theme.accent) >= 4.5
    for mark in (*MARKS.values(), WARNING, ERROR):
        assert contrast(mark, theme.halo) >= 2.0


def test_appearance_follows_what_is_chosen(qapp, qtbot):
    appearance = Appearance(qapp, "light")
    assert appearance.theme is LIGHT
    assert qapp.palette().window().color().name() == LIGHT.window
    with qtbot.waitSignal(appearance.changed) as got:
        appearance.choose("dark")
    assert got.args == [DARK]
    assert qapp.palette().window().color().name() == DARK.window
    assert appearance.choose("system") in (DARK, LIGHT)
    appearance.deleteLater()


def test_icons_are_drawn_in_the_theme_and_never_fail(qapp):
    for name in ("mdi6.lasso", "mdi6.vector-curve", "mdi6.no-such-icon"):
        image = icon(name, DARK).pixmap(32, 32).toImage()
        assert not image.isNull()
        alpha = [image.pixelColor(x, y).alpha() for x in range(32) for y in range(32)]
        assert max(alpha) > 200
