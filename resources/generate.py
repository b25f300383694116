"""Make the sample meshes again: ``python -m resources.generate [NAME ...]``."""

from __future__ import annotations

import argparse
import importlib
import logging
from pathlib import Path

from resources import SAMPLES
from resources.generators.sample import write

log = logging.getLogger(__name__)


def generate(name: str, folder: Path) -> None:
    """Make one sample and write its two files into a folder."""
    sample = importlib.import_module(f"resources.generators.{name}").make()
    folder.mkdir(parents=True, exist_ok=True)
    write(sample, folder, name)
    log.info("%s: %d vertices, %d faces", name, len(sample.vertices), len(sample.faces))


def main() -> None:
    """Make the samples named on the command line, or all."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", default=[], help=", ".join(SAMPLES))
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "meshes")
    chosen = parser.parse_args()
    for name in chosen.names or SAMPLES:
        generate(name, chosen.out)


if __name__ == "__main__":
    main()
