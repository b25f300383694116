"""Single plugin files: off until switched on, off again when changed, named when they fail."""

from __future__ import annotations

from pathlib import Path

import pytest

import plugins.importing
from engine import EngineError
from plugins.dropin import dropins, switch
from plugins.registry import find_steps, find_tools
from tests.plugins import gate

SOURCE = """
from dataclasses import dataclass, field
from plugins.api import DataStep, I64, RegionTool

@dataclass(frozen=True, eq=False)
class LiftStep(DataStep):
    roi: I64
    height: float = 1.0
    kind = "lift"

    def apply(self, mesh, run=None):
        vertices = mesh.vertices.copy()
        vertices[self.roi, 2] += self.height
        return mesh.with_vertices(vertices)

class Lift(RegionTool):
    id = "lift"
    title = "Lift"

    def step(self, roi, options, document):
        return LiftStep(roi)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("EIGENFORM_PLUGINS", str(tmp_path))
    (tmp_path / "lift.py").write_text(SOURCE, encoding="utf-8")
    return tmp_path


def test_a_file_is_off_until_it_is_switched_on(folder: Path) -> None:
    assert "lift" not in find_tools().items
    assert [one.on for one in dropins()] == [False]
    switch("lift", True)
    assert "lift" in find_tools().items
    assert "lift" in find_steps().items
    switch("lift", False)
    assert "lift" not in find_tools().items


def test_a_file_that_was_changed_is_off_again(folder: Path) -> None:
    switch("lift", True)
    (folder / "lift.py").write_text(SOURCE + "\n# other\n", encoding="utf-8")
    assert [(one.on, one.changed) for one in dropins()] == [(False, True)]
    assert "lift" not in find_tools().items


def test_a_file_that_raises_is_listed_with_the_reason(folder: Path) -> None:
    (folder / "broken.py").write_text("1 / 0\n", encoding="utf-8")
    switch("broken", True)
    found = find_tools()
    assert "lasso" in found.items
    failure = next(f for f in found.failures if f.name == "broken")
    assert "division by zero" in failure.reason
    assert failure.distribution == "broken.py"


def test_a_file_that_exits_is_listed_with_the_reason(folder: Path) -> None:
    (folder / "script.py").write_text("import sys\nsys.exit('done')\n")
    switch("script", True, folder)
    found = find_tools()
    assert "lasso" in found.items
    (failure,) = (f for f in found.failures if f.name == "script")
    assert failure.reason == "ImportError: it raised SystemExit: done"


@pytest.mark.parametrize("stop", ["KeyboardInterrupt", "GeneratorExit", "BaseException"])
def test_a_file_may_raise_whatever_it_likes(folder: Path, stop: str) -> None:
    (folder / "odd.py").write_text(f"raise {stop}('so there')", encoding="utf-8")
    switch("odd", True, folder)
    found = find_tools()
    assert "lasso" in found.items
    (failure,) = (f for f in found.failures if f.name == "odd")
    assert failure.reason == f"ImportError: it raised {stop}: so there"


HANGING = {
    "loop": "while True: pass",
    "stubborn loop": """
while True:
    try:
        pass
    except Exception:
        pass
""",
    "wait": "import tests.plugins.gate as gate; gate.OPEN.wait()",
}


@pytest.mark.parametrize("how", HANGING)
def test_a_file_that_hangs_is_left_out_and_not_tried_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    gate.OPEN.clear()
    counted = f"import tests.plugins.gate as gate\ngate.TRIED.append({how!r})\n"
    (folder / "hang.py").write_text(counted + HANGING[how], encoding="utf-8")
    switch("hang", True, folder)
    monkeypatch.setattr(plugins.importing, "SECONDS", 1.0)
    try:
        for _ in range(2):
            found = find_tools()
            assert "lasso" in found.items
            (failure,) = (f for f in found.failures if f.name == "hang")
            assert failure.reason == "ImportHungError: it was not imported within 1 seconds"
            assert "lift" not in find_steps().items
        assert gate.TRIED.count(how) <= 1
    finally:
        gate.OPEN.set()


def test_a_file_that_is_none_any_more_is_off(folder: Path) -> None:
    for name in ("gone", "folder"):
        (folder / f"{name}.py").write_text("")
        switch(name, True, folder)
        (folder / f"{name}.py").unlink()
    (folder / "folder.py").mkdir()
    assert not any(one.on for one in dropins(folder))
    assert "lasso" in find_tools().items


def test_switching_on_what_is_not_there_says_so(folder: Path) -> None:
    with pytest.raises(EngineError, match="no plugin file"):
        switch("nothing", True)


def test_a_folder_that_does_not_exist_has_no_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EIGENFORM_PLUGINS", "/does/not/exist")
    assert dropins() == []
    assert "lasso" in find_tools().items
