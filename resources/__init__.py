"""What the program ships beside its code: sample meshes and what is known about their form."""

from __future__ import annotations

from pathlib import Path

from resources.samples import SAMPLES, Features, features, sample_path

EXAMPLES = Path(__file__).parent / "examples"
"""Folder of the example plugin and the example script that the README shows."""

__all__ = ["EXAMPLES", "SAMPLES", "Features", "features", "sample_path"]
