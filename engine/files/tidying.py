"""Cleanup of a mesh that is open already, in the worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from engine.files.cleanup import clean_up
from engine.files.wire import Arrays


def tidy_mesh(
    job: dict[str, Any], arrays: Arrays, tick: Callable[[float, str], None]
) -> tuple[dict[str, Any], Arrays]:
    """Clean the mesh of `arrays`; answer with the repairs, the warnings and the new arrays."""
    made = clean_up(arrays["vertices"], arrays["faces"], tick)
    answer = {"repairs": [asdict(r) for r in made.repairs], "warnings": list(made.warnings)}
    return answer, {"vertices": made.vertices, "faces": made.faces}
