"""Icons of the Material Design set, in the theme's text colour, crisp at every scale."""

from __future__ import annotations

import qtawesome
from PySide6.QtGui import QIcon

from app.look.colours import Theme


def icon(name: str, theme: Theme, colour: str | None = None) -> QIcon:
    """Return the icon `name` (for example "mdi6.lasso") coloured for `theme`.

    A name that the icon font does not know gives the puzzle piece of a plugin: an icon is never a
    reason to fail.
    """
    colours = {
        "color": colour or theme.text,
        "color_disabled": theme.border,
        "color_on": colour or theme.text,
    }
    try:
        return qtawesome.icon(name, **colours)
    except Exception as error:  # qtawesome raises a bare Exception for an unknown name
        if "Invalid" not in str(error) and not isinstance(error, (KeyError, AttributeError)):
            raise
        return qtawesome.icon("mdi6.puzzle-outline", **colours)
