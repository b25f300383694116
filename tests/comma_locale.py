"""The whole test suite under another locale: `make test LOCALE=de_DE.UTF-8`.

Qt and other native code take over the locale of the desktop, and a comma in it has made C
libraries read 0.348 as 0. The locale is made with localedef where the system has only C.
"""

from __future__ import annotations

import locale
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

WANTED = "EIGENFORM_TEST_LOCALE"
"""Environment variable that names the locale for the whole run."""


def make(name: str, folder: Path) -> dict[str, str]:
    """Return the environment under which programs run in the locale `name`, or {} if none can.

    Parameters
    ----------
    name : such as de_DE.UTF-8.
    folder : where the locale is made, if it was not yet.
    """
    tool = shutil.which("localedef")
    numbers = folder / name / "LC_NUMERIC"
    if not numbers.is_file():
        if tool is None:
            return {}
        folder.mkdir(parents=True, exist_ok=True)
        language, _, encoding = name.partition(".")
        command = [tool, "-i", language, "-f", encoding, str(folder / name)]
        # It may end with a warning and have made the locale all the same, or leave an empty folder.
        subprocess.run(command, capture_output=True, timeout=60, check=False)
        if not numbers.is_file():
            return {}
    return {"LOCPATH": str(folder), "LC_ALL": name, "LANG": name}


def enter(folder: Path) -> str:
    """Put this process and its children into the wanted locale; return a line about it, or "".

    Raises
    ------
    RuntimeError
        The locale cannot be made.
    """
    name = os.environ.get(WANTED, "")
    if not name:
        return ""
    environment = make(name, folder)
    if not environment:
        raise RuntimeError(f"The locale {name} cannot be made here: install the package locales.")
    os.environ.update(environment)
    locale.setlocale(locale.LC_ALL, "")
    return f"locale {name}: the decimal point is “{decimal_point()}”"


def decimal_point() -> str:
    """Return what C code writes between whole and fraction at this moment."""
    return str(locale.localeconv()["decimal_point"])


@contextmanager
def plain_numbers() -> Iterator[None]:
    """Have C code read and write decimal points meanwhile: other people's readers need them."""
    before = locale.setlocale(locale.LC_NUMERIC)
    locale.setlocale(locale.LC_NUMERIC, "C")
    try:
        yield
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)
