"""All scenes by name, and the pictures that each of them keeps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.pictures import (
    commands,
    files,
    first_edit,
    level,
    region,
    seeing,
    sketching,
    tools,
    variants,
)
from tests.pictures.studio import Stage


@dataclass(frozen=True)
class Scene:
    """What is done in the window, and the names of the pictures kept on the way."""

    take: Callable[[Stage], None]
    pictures: tuple[str, ...]


SCENES: dict[str, Scene] = {
    "first-edit": Scene(
        first_edit.first_edit,
        ("1-open", "2-circle", "3-level", "4-source", "5-target", "6-applied"),
    ),
    "region": Scene(region.region, ("region-brush", "region-name", "region-menu")),
    "symmetric": Scene(region.symmetric, ("region-plane", "region-symmetric")),
    "level": Scene(level.level, ("level-panel", "level-feature", "level-modes")),
    "pen": Scene(sketching.pen, ("sketch-source", "sketch-drag", "sketch-redraw")),
    "pressure": Scene(sketching.pressure, ("pen-pressure",)),
    "several": Scene(sketching.several, ("sketch-several",)),
    "trace": Scene(sketching.trace, ("sketch-trace",)),
    "outline": Scene(sketching.outline, ("region-adjust", "sketch-outline")),
    "closed": Scene(sketching.closed, ("sketch-closed",)),
    "seeing": Scene(
        seeing.seeing,
        (
            "see-edited",
            "see-original",
            "see-deviation",
            "see-curvature",
            "see-zebra",
            "see-reflection",
            "see-base",
            "see-occlusion",
            "see-wireframe",
            "see-measure",
        ),
    ),
    "kept": Scene(seeing.kept, ("see-menu", "see-picture")),
    "variants": Scene(
        variants.variants,
        (
            "variants-tree",
            "variants-flip",
            "variants-flipped",
            "variants-compare",
            "variants-morph",
        ),
    ),
    "tools": Scene(
        tools.tools,
        (
            "tool-smooth",
            "tool-equaliser",
            "tool-inflate",
            "tool-handle",
            "tool-symmetrise",
            "tool-remesh",
        ),
    ),
    "files": Scene(
        files.files,
        ("files-report", "files-unit", "files-recent", "files-restore", "files-closing"),
    ),
    "by-keys": Scene(commands.by_keys, ("keys-drawing",)),
    "commands": Scene(
        commands.commands, ("keys-palette", "keys-sheet", "keys-plugins", "looks-dark")
    ),
}
