"""What a generator returns, and how it is written down."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from resources.generators.remesh import Faces, Points


@dataclass(frozen=True)
class Sample:
    """A sample mesh with what is known about its form.

    Parameters
    ----------
    vertices : (n, 3) positions in millimetres.
    faces : (f, 3) counter-clockwise seen from outside.
    plain : (n, 3) where each vertex lies on the form without features.
    parts : signed heights (n,) in millimetres of each kind of feature at each vertex.
    region : (n,) mask of the region that the paper's example edits.
    """

    vertices: Points
    faces: Faces
    plain: Points
    parts: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    region: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))


def write(sample: Sample, folder: Path, name: str) -> None:
    """Write ``name.ply`` (binary, single precision) and ``name.npz`` into a folder."""
    vertices = sample.vertices.astype("<f4")
    rows = np.empty(len(sample.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"] = 3
    rows["corners"] = sample.faces
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"comment Eigenform sample: {name}, millimetres\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(rows)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (folder / f"{name}.ply").write_bytes(header.encode() + vertices.tobytes() + rows.tobytes())
    heights = {f"height_{part}": h.astype("<f4") for part, h in sample.parts.items()}
    np.savez_compressed(
        folder / f"{name}.npz",
        plain=sample.plain.astype("<f4"),
        region=sample.region,
        **heights,
    )
