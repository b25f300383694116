"""app -> plugins -> engine, and nothing of the machine it was written on."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.program import PATIENCE

ROOT = Path(__file__).resolve().parents[1]
MAY_IMPORT = {
    "engine": {"engine"},
    "plugins": {"plugins", "engine"},
    "resources": {"resources", "engine"},
    "app": {"app", "plugins", "engine", "resources"},
}
LAYERS = set(MAY_IMPORT)
GRAPHICS = {"PySide6", "qtpy", "vtk", "vtkmodules", "pyvista", "pyvistaqt", "superqt", "qtawesome"}


def modules(package: str) -> list[Path]:
    # Examples are scripts as a person writes them on top of everything; no layer imports them.
    found = [p for p in sorted((ROOT / package).rglob("*.py")) if "examples" not in p.parts]
    assert found, f"{package} has no modules"
    return found


def imported(path: Path) -> Iterator[str]:
    """Yield the dotted names that a file imports, also inside functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("package", sorted(LAYERS))
def test_imports_go_right_only(package: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in modules(package)
        for name in imported(path)
        if (top := name.split(".")[0]) in LAYERS and top not in MAY_IMPORT[package]
    ]
    assert wrong == []


@pytest.mark.parametrize("package", ["engine", "plugins"])
def test_no_qt_and_no_vtk_is_imported(package: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in modules(package)
        for name in imported(path)
        if name.split(".")[0] in GRAPHICS
    ]
    assert wrong == []


def test_loading_engine_and_tool_api_loads_no_qt_and_no_vtk() -> None:
    code = (
        "import engine, plugins.api, sys\n"
        "print(sorted({m.split('.')[0] for m in sys.modules} & set(sys.argv[1:])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *GRAPHICS],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"


def test_the_window_names_no_concrete_tool() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    built_in = project["entry-points"]["eigenform.tools"].values()
    assert built_in
    files = {value.split(":")[0] for value in built_in}
    classes = {value.split(":")[1] for value in built_in}
    wrong = []
    for path in modules("app"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        used = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
        used |= {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
        names = set(imported(path))
        wrong += [f"{path.name}: {name}" for name in used & classes]
        wrong += [
            f"{path.name}: {name}"
            for name in names
            if any(name == f or name.startswith(f + ".") for f in files)
        ]
    assert wrong == []


def committed_text() -> Iterator[tuple[str, str]]:
    """Yield (name, text) of every text file under version control."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    listed = subprocess.run(
        ["git", "ls-files", "-z"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=PATIENCE,
        check=False,
    )
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if not path.is_file() or path.stat().st_size > 2_000_000:
            continue
        try:
            yield name, path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


# Put together from pieces, so that this file does not hold what it looks for.
MACHINE = "|".join(["/" + "work/", "/" + "root/", "/" + "home/" + r"\w", "C:" + r"\\Users\\"])
HOSTS = "|".join(["pypi" + r"\.org", "python" + "hosted", "index" + "-url", "find" + "-links"])
HOSTS += "|" + "|".join(["conda" + r"\.io", "anaconda" + r"\.(org|com)", "npmjs" + r"\."])


def test_no_path_of_a_machine_is_committed() -> None:
    wrong = [name for name, text in committed_text() if re.search(MACHINE, text)]
    assert wrong == []


def test_no_package_registry_is_named() -> None:
    wrong = [name for name, text in committed_text() if re.search(HOSTS, text)]
    assert wrong == []


def test_constraints_hold_names_and_versions_only() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split("\n")
    wrong = [line for line in lines if line and not re.fullmatch(r"[A-Za-z0-9._-]+==[\w.+]+", line)]
    assert wrong == []


def test_every_dependency_is_constrained() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    wanted = [entry for group in groups for entry in group]
    names = {re.match(r"[A-Za-z0-9._-]+", entry)[0].lower().replace("_", "-") for entry in wanted}
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split()
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in lines}
    assert names - pinned == set()


@pytest.mark.parametrize("package", sorted(LAYERS))
def test_every_module_says_what_it_is(package: str) -> None:
    silent = [
        str(path.relative_to(ROOT))
        for path in modules(package)
        if (text := path.read_text(encoding="utf-8")).strip()
        and ast.get_docstring(ast.parse(text)) is None
    ]
    assert silent == []
