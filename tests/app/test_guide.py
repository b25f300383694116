"""README and guide: every picture they show is there, is kept by a scene, and none is left over."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from app.commands import commands
from tests.pictures.__main__ import FIGURES, SHOWN, take
from tests.pictures.scenes import SCENES

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", ROOT / "resources" / "guide.md")
SHEETS = {f"figure-{number}" for number in FIGURES.values()}  # of `app.demo`


def shown(page: Path) -> list[Path]:
    """Return the pictures that a page shows."""
    links = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    return [(page.parent / link).resolve() for link in links if "://" not in link]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_picture_shown_is_there_and_small(page: Path) -> None:
    pictures = shown(page)
    assert len(pictures) >= 8
    for picture in pictures:
        assert picture.is_file(), f"{page.name} shows {picture.name}, which is not there"
        assert picture.stat().st_size < 200_000, f"{picture.name} is too large to be kept"


def test_every_picture_kept_is_shown_and_is_of_a_scene() -> None:
    kept = {path.stem for path in SHOWN.iterdir()}
    told = {path.stem for page in PAGES for path in shown(page)}
    taken = {name for scene in SCENES.values() for name in scene.pictures}
    assert kept <= told, f"nobody shows {sorted(kept - told)}"
    assert told - SHEETS <= taken, f"no scene takes {sorted(told - SHEETS - taken)}"
    assert taken <= told, f"taken for nothing: {sorted(taken - told)}"


def test_no_two_scenes_keep_one_picture() -> None:
    names = [name for scene in SCENES.values() for name in scene.pictures]
    assert len(names) == len(set(names))


def test_a_scene_takes_its_pictures(qapp, tmp_path: Path, monkeypatch) -> None:
    """The scene drives a whole window; `take` says when it kept other pictures than it tells."""
    for name in ("HOME", "XDG_STATE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    assert take("closed", "light", tmp_path) == 0
    assert {path.stem for path in tmp_path.glob("*.png")} == set(SCENES["closed"].pictures)


def test_the_guide_tells_the_keys_of_every_tool_and_view(make_window) -> None:
    """A key in the guide does what is said beside it; a tool without a word is missing there."""
    text = (ROOT / "resources" / "guide.md").read_text(encoding="utf-8")
    for action in commands(make_window()):
        if action.id.startswith("tool."):
            assert action.title in text, f"the guide does not tell of the tool {action.title}"
        for key in action.shortcuts:
            if len(key) == 1 and key.isalnum() and not action.id.startswith("level."):
                assert re.search(rf"\b{key}\b", text), f"the guide does not tell {key}, {action.id}"
