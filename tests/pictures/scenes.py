"""All scenes by name."""

from __future__ import annotations

from collections.abc import Callable

from tests.pictures.first_edit import first_edit
from tests.pictures.studio import Stage

SCENES: dict[str, Callable[[Stage], None]] = {
    "first-edit": first_edit,
}
