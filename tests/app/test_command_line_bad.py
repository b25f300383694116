"""What is given to the command line may be anything: an exit code, one sentence, no traceback."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

import app.headless
from app.__main__ import main
from app.batch.vary import Variation, combinations
from app.demo import RECIPES
from engine import EngineError
from resources import sample_path
from tests.program import run_python

PLATE = (str(RECIPES / "plate.json"), str(sample_path("plate")))


def recipe(**changes: object) -> str:
    """Return the plate's recipe with other values in its only step."""
    data = json.loads((RECIPES / "plate.json").read_text(encoding="utf-8"))
    data["steps"][0] |= changes
    return json.dumps(data)


BAD: dict[str, str | bytes] = {
    "nothing": "",
    "zeros": bytes(100),
    "a web page": "<html>",
    "a list": "[]",
    "a number": "1",
    "not a number": '{"eigenform": 1, "steps": [NaN]}',
    "too deep": "[" * 200_000,
    "utf-16": recipe().encode("utf-16"),
    "not utf-8": '{"ä": 1}'.encode("latin-1"),
    "of the future": '{"eigenform": 99, "steps": []}',
    "a version of many digits": '{"eigenform": %s, "steps": []}' % ("9" * 5000),
    "steps that are none": '{"eigenform": 1, "steps": ["a"]}',
    "a kind that paints": '{"eigenform": 1, "steps": [{"kind": "\\u001b[31mred"}]}',
    "a kind without end": '{"eigenform": 1, "steps": [{"kind": "%s"}]}' % ("k" * 10_000),
    "a kind of half a letter": '{"eigenform": 1, "steps": [{"kind": "\\ud800"}]}',
    "a level of many digits": recipe(level=10**400),
    "a region beyond the mesh": recipe(roi=[10**9]),
    "a region of halves": recipe(roi=[0.5]),
    "a region of nothing": recipe(roi=None),
    "strokes of numbers": recipe(strokes=[3]),
    "options of nothing": recipe(options=[None]),
}


def said(capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one sentence on standard error."""
    text = capsys.readouterr().err.strip("\n")
    assert text.startswith("eigenform: ")
    assert text.isprintable(), "on one line, and nothing that moves the cursor"
    assert len(text) < 1200
    assert "in Eigenform itself" not in text, "no bug of ours"
    return text


@pytest.mark.parametrize("name", sorted(BAD))
def test_a_recipe_that_is_none(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "recipe.json"
    data = BAD[name]
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    assert main(["replay", str(path), PLATE[1], str(tmp_path / "out.ply")]) == 2
    said(capsys)
    assert not (tmp_path / "out.ply").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="it has no mkfifo and no /dev/zero")
@pytest.mark.parametrize("place", ["pipe", "/dev/zero", "circle", "folder", "x" * 5000, "a\nb"])
def test_a_place_that_is_no_file_is_never_waited_for(
    place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "folder").mkdir()
    odd, out = str(tmp_path / place), str(tmp_path / "out.ply")
    assert main(["replay", odd, PLATE[1], out]) == 2
    said(capsys)
    assert main(["replay", PLATE[0], odd, out]) == 2
    said(capsys)
    assert main(["sweep", odd, PLATE[1], "--vary", "level=0", "--out", str(tmp_path / "s")]) == 2
    said(capsys)


def test_a_recipe_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    path = tmp_path / "recipe.json"
    path.write_bytes(b"\xef\xbb\xbf" + recipe().encode())
    assert app.headless.read_recipe(path).steps


def test_variants_beyond_all_counting_are_refused() -> None:
    # Five times 8,192 values are 2^65 variants, which is 0 in 64 bits.
    many = [Variation.parse(f"{name}=0:1:8192") for name in "abcde"]
    with pytest.raises(EngineError, match="36,893,488,147,419,103,232 variants"):
        next(combinations(many))


@pytest.mark.parametrize("workers", ["0", "-1", "1000000000"])
def test_a_number_of_processes_that_cannot_be(
    workers: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    out = ["--out", str(tmp_path / "s"), "--workers", workers]
    assert main(["sweep", *PLATE, "--vary", "level=0.1", *out]) == 2
    assert "from 1 to 256" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such a name")
def test_a_batch_names_files_whose_names_are_no_text(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.ply")
    out = tmp_path / "out"
    assert main(["batch", PLATE[0], odd, "--out", str(out)]) == 1
    told = capsys.readouterr().err
    assert "is not there" in told
    assert told.isascii() or "\udcff" not in told
    assert "is not there" in (out / "table.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("error", "code"), [(ZeroDivisionError("a\nb"), 3), (MemoryError(), 2), (RecursionError(), 3)]
)
def test_a_bug_of_ours_is_one_sentence_too(
    error: BaseException,
    code: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_given: object) -> None:
        raise error

    monkeypatch.setattr(app.headless, "replay_file", fail)
    assert main(["replay", *PLATE, str(tmp_path / "out.ply")]) == code
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "Traceback" not in told


@pytest.mark.skipif(sys.platform == "win32", reason="it has no RLIMIT_FSIZE")
def test_a_demo_whose_pictures_find_no_room_says_so(tmp_path: Path) -> None:
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, 9_000))\n"
        "from app.__main__ import main\n"
        "sys.exit(main(['demo', 'plate', '--out', sys.argv[1]]))\n"
    )
    ended = run_python("-c", program, str(tmp_path / "out"), cwd=tmp_path)
    assert ended.returncode == 2
    # A graphics driver may say before that it finds no room either.
    assert ended.stderr.splitlines()[-1].startswith("eigenform: “01-the-model.png” was not saved")
    assert "Traceback" not in ended.stderr
    assert ended.stderr.count("eigenform:") == 1
    assert list((tmp_path / "out").iterdir()) == []
