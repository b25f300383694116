"""Drop-in plugins: single Python files in a folder, used only after a person switched them on.

A file is known by its content: one that was changed after it was switched on is off again, so that
nothing runs that nobody agreed to.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import os
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import platformdirs

from plugins.api import EngineError, Tool
from plugins.importing import imported

SWITCHES = "switched-on.json"

_modules: dict[str, ModuleType] = {}
_importing = threading.Lock()


def dropin_folder() -> Path:
    """Return the folder of drop-in files; `EIGENFORM_PLUGINS` names another."""
    named = os.environ.get("EIGENFORM_PLUGINS")
    return Path(named) if named else platformdirs.user_data_path("eigenform") / "plugins"


@dataclass(frozen=True)
class DropIn:
    """One file of the folder.

    Parameters
    ----------
    path : the file.
    on : whether the person switched it on as it is now.
    changed : whether it was switched on and then changed.
    """

    path: Path
    on: bool
    changed: bool

    @property
    def name(self) -> str:
        """File name without its ending."""
        return self.path.stem


@dataclass(frozen=True)
class DropInPoint:
    """One tool or step of a drop-in file; it is used like an entry point."""

    name: str
    origin: str
    item: Any

    def load(self) -> Any:
        """Return the class, or raise what the file raised when it was read."""
        if isinstance(self.item, BaseException):
            raise self.item
        return self.item


def dropins(folder: Path | None = None) -> list[DropIn]:
    """Return the files of the folder in the order of their names, on or off."""
    folder = dropin_folder() if folder is None else folder
    switches = _switches(folder)
    found = []
    for path in sorted(folder.glob("*.py")):
        agreed = switches.get(path.name)
        same = agreed is not None and agreed == _digest_or_none(path)
        found.append(DropIn(path, same, agreed is not None and not same))
    return found


def switch(name: str, on: bool, folder: Path | None = None) -> None:
    """Switch the drop-in file `name` (without ending) on or off for the next start.

    Raises
    ------
    EngineError
        There is no such file, or the choice cannot be written.
    """
    folder = dropin_folder() if folder is None else folder
    path = folder / f"{name}.py"
    if on and not path.is_file():
        raise EngineError(f"There is no plugin file {path}. Put it there first.")
    switches = _switches(folder)
    if on:
        switches[path.name] = _digest(path)
    else:
        switches.pop(path.name, None)
    part = folder / f"{SWITCHES}.part"
    try:
        part.write_text(json.dumps(switches, indent=1), encoding="utf-8")
        part.replace(folder / SWITCHES)
    except OSError as error:
        raise EngineError(
            f"The choice cannot be kept in {folder} ({error.strerror}). Check the folder's rights."
        ) from error


def dropin_points(folder: Path | None = None) -> tuple[list[DropInPoint], list[DropInPoint]]:
    """Return the tools and the steps of all files that are switched on."""
    tools: list[DropInPoint] = []
    steps: list[DropInPoint] = []
    for one in dropins(folder):
        if not one.on:
            continue
        try:
            module = _module(one.path)
        except Exception as error:  # noqa: BLE001 - whatever a stranger's file does
            tools.append(DropInPoint(one.name, one.path.name, error))
            continue
        for item in vars(module).values():
            if not isinstance(item, type) or item.__module__ != module.__name__:
                continue
            if issubclass(item, Tool) and isinstance(getattr(item, "id", None), str):
                tools.append(DropInPoint(item.id, one.path.name, item))
            kind = getattr(item, "kind", None)
            if isinstance(kind, str) and hasattr(item, "apply"):
                steps.append(DropInPoint(kind, one.path.name, item))
    return tools, steps


def _switches(folder: Path) -> dict[str, str]:
    with contextlib.suppress(OSError, ValueError):
        data = json.loads((folder / SWITCHES).read_text(encoding="utf-8"))
        if isinstance(data, dict):
            return {str(k): str(v) for k, v in data.items()}
    return {}


def _digest_or_none(path: Path) -> str | None:
    """Return the digest of a file; None for one that may not be read any more, or is none."""
    try:
        return _digest(path) if path.is_file() else None
    except OSError:
        return None


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _module(path: Path) -> ModuleType:
    """Import a file under a name of its own; a second call returns the same module."""
    name = f"eigenform_dropin_{path.stem}_{_digest(path)[:12]}"
    with _importing:
        if name not in _modules:
            _modules[name] = imported(name, lambda: _import(name, path))
        return _modules[name]


def _import(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


__all__ = ["DropIn", "DropInPoint", "dropin_folder", "dropin_points", "dropins", "switch"]
