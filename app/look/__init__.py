"""Look: colours that mean one thing, the dark and the light theme, and icons."""

from app.look.colours import (
    DARK,
    ERROR,
    GUIDE,
    LIGHT,
    PIN,
    REGION,
    RIM,
    ROLE_COLOURS,
    SOURCE,
    TARGET,
    WARNING,
    Theme,
    rgb,
    rgb8,
)
from app.look.icons import icon
from app.look.theme import Appearance

__all__ = [
    "DARK",
    "ERROR",
    "GUIDE",
    "LIGHT",
    "PIN",
    "REGION",
    "RIM",
    "ROLE_COLOURS",
    "SOURCE",
    "TARGET",
    "WARNING",
    "Appearance",
    "Theme",
    "icon",
    "rgb",
    "rgb8",
]
