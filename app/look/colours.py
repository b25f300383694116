"""Every colour of the window, once: what means something, and the two neutral themes.

The meaningful colours are the same in both themes. They differ in lightness as well as in hue, so
that they stay apart for people who see red and green alike.
"""

from __future__ import annotations

from dataclasses import dataclass

REGION = "#7e52cf"
RIM = "#f2b134"
SOURCE = "#0b8f7a"
TARGET = "#ff6a52"
PIN = "#6cc0ff"
WARNING = "#e8821e"
ERROR = "#d93a4a"
GUIDE = "#c8ccd2"

#: Colour of what a tool draws, by the role it gives to its ink.
ROLE_COLOURS = {
    "region": REGION,
    "rim": RIM,
    "source": SOURCE,
    "target": TARGET,
    "pin": PIN,
    "guide": GUIDE,
}


@dataclass(frozen=True)
class Theme:
    """The neutral colours of one theme, as "#rrggbb".

    Parameters
    ----------
    window, panel, field, border : surfaces of the window, from back to front.
    text, faint : text, and text that may be overlooked.
    accent, accent_text : the selected thing, and what is written on it.
    sky, ground : top and bottom of the viewport's gradient.
    clay, held : the form, and the part of it that an edit holds.
    halo : the thin rim around strokes.
    edge : mesh edges in the wireframe display.
    """

    name: str
    window: str
    panel: str
    field: str
    border: str
    text: str
    faint: str
    accent: str
    accent_text: str
    sky: str
    ground: str
    clay: str
    held: str
    halo: str
    edge: str


DARK = Theme(
    name="dark",
    window="#26282b",
    panel="#2d2f33",
    field="#1f2123",
    border="#3d4046",
    text="#e4e5e7",
    faint="#9a9ea5",
    accent="#7d66cc",
    accent_text="#ffffff",
    sky="#4a4d52",
    ground="#232528",
    clay="#cfc3b5",
    held="#bdb7af",
    halo="#15161a",
    edge="#2b2a2c",
)

LIGHT = Theme(
    name="light",
    window="#ececee",
    panel="#f6f6f7",
    field="#ffffff",
    border="#cfd1d5",
    text="#222427",
    faint="#666a72",
    accent="#6f52c0",
    accent_text="#ffffff",
    sky="#f1f2f4",
    ground="#bfc2c7",
    clay="#d3c7b9",
    held="#c8c2bb",
    halo="#2a2b2f",
    edge="#5a5754",
)


def rgb8(colour: str) -> tuple[int, int, int]:
    """Return "#rrggbb" as three integers in 0..255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def rgb(colour: str) -> tuple[float, float, float]:
    """Return "#rrggbb" as three numbers in 0..1."""
    red, green, blue = rgb8(colour)
    return red / 255, green / 255, blue / 255
