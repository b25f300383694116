"""The samples can be made again from the code that ships with them."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from resources import SAMPLES, features, sample_path
from resources.generate import generate
from tests.program import PATIENCE

Reader = Callable[[Path], tuple[np.ndarray, np.ndarray]]
ROOT = Path(__file__).resolve().parents[2]


def same_surface(first: Path, second: Path, read_ply: Reader) -> bool:
    """Whether two files are equal, or their vertices lie on each other to 0.001 mm."""
    if first.read_bytes() == second.read_bytes():
        return True
    a, b = read_ply(first)[0], read_ply(second)[0]
    return a.shape == b.shape and float(cKDTree(a).query(b)[0].max()) < 1e-3


def test_the_plate_made_again_is_the_plate_shipped(tmp_path: Path, read_ply: Reader) -> None:
    generate("plate", tmp_path)
    assert same_surface(tmp_path / "plate.ply", sample_path("plate"), read_ply)
    with np.load(tmp_path / "plate.npz") as again:
        np.testing.assert_allclose(again["plain"], features("plate").plain, atol=1e-3)


@pytest.mark.soak  # half a minute each
@pytest.mark.parametrize("name", [name for name in SAMPLES if name != "plate"])
def test_the_others_made_again_are_those_shipped(
    name: str, tmp_path: Path, read_ply: Reader
) -> None:
    generate(name, tmp_path)
    assert same_surface(tmp_path / f"{name}.ply", sample_path(name), read_ply)


def test_a_wheel_carries_the_samples_and_finds_them(tmp_path: Path) -> None:
    """Installed from a wheel, outside the checkout, ``sample_path`` still gives files."""
    built = subprocess.run(
        [
            *(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"),
            *("--wheel-dir", str(tmp_path), str(ROOT)),
        ],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    if "No module named 'setuptools'" in built.stderr or "BackendUnavailable" in built.stderr:
        pytest.skip("the build back end is not installed here, so no wheel can be built")
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(tmp_path / "site")
    code = (
        "import resources; print(resources.__file__);"
        "print(all(resources.sample_path(n).is_file() for n in resources.SAMPLES));"
        "print(len(resources.features('plate').region))"
    )
    told = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path / "site"), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    ).stdout.split()
    assert Path(told[0]).is_relative_to(tmp_path / "site")
    assert told[1] == "True"
    assert int(told[2]) > 10_000
