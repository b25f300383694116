"""The README tells the truth: its examples are the files that tests run, its commands run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from app.__main__ import main

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["script_ten_lines.py", "plugin_in_20_lines.py"])
def test_the_examples_are_the_files(name: str) -> None:
    text = (ROOT / "resources" / "examples" / name).read_text(encoding="utf-8")
    assert f"```python\n{text}```" in README


def test_every_file_it_names_is_there() -> None:
    named = re.findall(
        r"\]\(([^)#:]+)\)|`((?:app|engine|plugins|resources|tests)/[\w./]+)`", README
    )
    assert len(named) > 15
    for link, code in named:
        assert (ROOT / (link or code)).exists(), link or code


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("command", ["sweep", "batch"])
def test_the_batch_commands_run(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (line,) = re.findall(rf"^eigenform ({command} resources.*)$", README, re.MULTILINE)
    words = shlex.split(line)
    words[words.index("--out") + 1] = str(tmp_path)
    monkeypatch.chdir(ROOT)
    assert main([*words, "--workers", "2"]) == 0
    assert (tmp_path / "table.csv").is_file()
    assert (tmp_path / "contact-sheet.png").is_file()
