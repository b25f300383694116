"""A slice of the suite under a comma locale; the whole is `make test LOCALE=de_DE.UTF-8`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import comma_locale
from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[1]
NAME = "de_DE.UTF-8"
CHOSEN = (
    "tests/engine/test_recipe.py::test_there_and_back",
    "tests/engine/test_recipe.py::TestChanges",
    "tests/engine/test_io_save.py::test_a_saved_mesh_comes_back_to_the_last_bit",
    "tests/engine/test_archive.py::test_everything_comes_back_to_the_last_bit",
    "tests/engine/test_journal.py::test_a_killed_program_leaves_everything",
    "tests/app/test_fields.py::test_enter_takes_a_number_and_then_applies",
    "tests/test_comma_locale.py::test_the_wanted_locale_outlives_what_calls_setlocale",
)


@pytest.fixture
def comma(tmp_path: Path) -> dict[str, str]:
    """The environment of a German desktop."""
    found = comma_locale.make(NAME, tmp_path / "locales")
    if not found:
        pytest.skip(f"the locale {NAME} cannot be made here")
    return found


def test_what_reads_and_writes_numbers_passes_under_a_comma(comma: dict[str, str]) -> None:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:xdist", "-p", "no:cacheprovider", *CHOSEN],
        cwd=ROOT,
        env={**environment, **comma, comma_locale.WANTED: NAME},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert "the decimal point is “,”" in done.stdout
    assert "skipped" not in done.stdout


@pytest.mark.skipif(not os.environ.get(comma_locale.WANTED), reason="no locale is asked for")
def test_the_wanted_locale_outlives_what_calls_setlocale(qapp) -> None:
    import pymeshlab
    import vtkmodules.all  # noqa: F401

    pymeshlab.MeshSet(verbose=False).create_cube()
    assert comma_locale.decimal_point() == ","
