"""Programs that are killed while they write, as a power cut would."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[1]


def lines_until_killed(module: str, folder: Path, seed: int, after: float) -> list[str]:
    """Run `python -m module folder seed`, kill it some seconds after its first line.

    Returns every line that it wrote; the kill may have cut off the last one.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", module, str(folder), str(seed)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert process.stdout is not None
    with process.stdout:
        late = threading.Timer(PATIENCE, process.kill)
        late.start()
        first = process.stdout.readline()
        late.cancel()
        assert first, f"{module} ended before it began, or did not begin in {PATIENCE:g} s"
        threading.Event().wait(after)
        process.kill()
        rest = process.stdout.read().split("\n")
    process.wait()
    return [first.strip(), *rest]
