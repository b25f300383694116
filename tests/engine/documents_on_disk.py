"""A small document file for tests, and the same with something changed in it."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from engine import FileError
from engine.archive import Archive, open_archive, save_archive
from tests.engine.histories import KINDS, PNG, fingerprint, history

WINDOW = {"camera": [0.1, 2, None, "a"], "open": {"x": True}}


def small_file(path: Path) -> tuple[bytes, str]:
    """Write a small document file; return its bytes, and the fingerprint of what is in it."""
    state = history().state()
    save_archive(path, state, {0: PNG, 2: PNG + b"2"}, WINDOW)
    return path.read_bytes(), fingerprint(state)


def rewritten(data: bytes, path: Path, change: Any) -> Path:
    """Write the document file `data` to `path` with its members (a dict) changed by `change`."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members = change(members) or members
    with zipfile.ZipFile(path, "w") as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return path


def with_manifest(data: bytes, path: Path, change: Any) -> Path:
    """Write the document file `data` with its manifest (a dict) changed by `change`."""

    def changed(members: dict[str, bytes]) -> None:
        manifest = json.loads(members["manifest.json"])
        change(manifest)
        text = json.dumps(manifest).encode()
        members["manifest.json"] = members["manifest-copy.json"] = text

    return rewritten(data, path, changed)


def outcome(path: Path, fingerprint_of_whole: str) -> str:
    """Open a damaged file: "whole", "partial" or "refused"; anything else fails the test."""
    try:
        found = open_archive(path, KINDS)
    except FileError as error:
        sentence = str(error)
    else:
        sentence = ""
    if sentence:
        assert path.name in sentence
        assert sentence.endswith(".")
        return "refused"
    check_sound(found)
    if found.report:
        assert all(line.endswith(".") for line in found.report)
        return "partial"
    assert fingerprint(found.state) == fingerprint_of_whole, "a change went unnoticed"
    assert dict(found.pictures) == {0: PNG, 2: PNG + b"2"}
    return "whole"


def check_sound(found: Archive) -> None:
    """Check that what was found can be worked with."""
    for moment in found.state.moments.values():
        mesh = moment.document.mesh
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.max() < mesh.n
        assert moment.parent is None or moment.parent in found.state.moments
    again = found.history
    while again.can_undo:
        again.undo()
