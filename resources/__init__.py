"""What the program ships beside its code: sample meshes and what is known about their form."""

from __future__ import annotations

from resources.samples import SAMPLES, Features, features, sample_path

__all__ = ["SAMPLES", "Features", "features", "sample_path"]
