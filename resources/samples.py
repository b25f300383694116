"""The sample meshes: where they are, and the true form behind each."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SAMPLES: dict[str, str] = {
    "vase": "Vase with bumps and dimples",
    "tank": "Fuel tank with cap and side grooves",
    "drill": "Drill with finger grooves and small bumps",
    "plate": "Wavy plate",
}
"""Names of the samples and the titles to show for them."""


@dataclass(frozen=True)
class Features:
    """The truth behind a sample, row for row with its vertices.

    Parameters
    ----------
    plain : (n, 3) where each vertex lies on the form without any feature, mm.
    heights : for each kind of feature its signed height above the plain form, (n,) mm.
    region : (n,) mask of the region that the paper's example edits.
    """

    plain: NDArray[np.float64]
    heights: dict[str, NDArray[np.float64]]
    region: NDArray[np.bool_]

    @property
    def height(self) -> NDArray[np.float64]:
        """Signed height of all features together, (n,) mm."""
        return np.asarray(sum(self.heights.values()), dtype=float)

    @property
    def featured(self) -> NDArray[np.bool_]:
        """Mask (n,) of the vertices that carry a feature of more than 0.02 mm."""
        featured = [np.abs(h) > 0.02 for h in self.heights.values()]
        return np.asarray(np.any(featured, axis=0), dtype=np.bool_)


def sample_path(name: str) -> Path:
    """Return the path of a sample's mesh file.

    Raises
    ------
    KeyError
        No sample has this name; the names are the keys of ``SAMPLES``.
    """
    return _file(name, ".ply")


def features(name: str) -> Features:
    """Return what is known about a sample's form; KeyError as in ``sample_path``."""
    with np.load(_file(name, ".npz")) as stored:
        return Features(
            plain=stored["plain"].astype(np.float64),
            heights={
                key.removeprefix("height_"): stored[key].astype(np.float64)
                for key in stored.files
                if key.startswith("height_")
            },
            region=stored["region"],
        )


def _file(name: str, suffix: str) -> Path:
    if name not in SAMPLES:
        raise KeyError(f"There is no sample {name!r}. The samples are {', '.join(SAMPLES)}.")
    return Path(str(files("resources") / "meshes" / f"{name}{suffix}"))
