"""Screens of more pixels: the camera's numbers hold, everything is whole and crisp."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("scale", ["1.25", "1.5", "2"])
def test_the_projection_holds_and_the_window_is_whole_and_crisp(
    scale: str, tmp_path: Path, artefacts: Path
) -> None:
    picture = artefacts / f"at {scale}.png"
    told = subprocess.run(
        [sys.executable, "-m", "tests.app.fine_screen", scale, str(tmp_path), str(picture)],
        env={**os.environ, "QT_SCALE_FACTOR": scale, "OPENBLAS_NUM_THREADS": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert told.returncode == 0, told.stderr[-2000:]
    assert not told.stdout.strip(), told.stdout
    assert picture.stat().st_size > 10_000
