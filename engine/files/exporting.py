"""Export, in the worker: written under another name, pushed to the disk, and read back."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.importing import read_soup
from engine.files.soup import settle
from engine.files.wire import Arrays

Tick = Callable[[float, str], None]

# How far a coordinate may be off after export, relative to the largest one: 0 is to the last bit.
PRECISION = {".obj": 0.0, ".off": 0.0, ".ply": 0.0, ".stl": 2.0**-23}


def export_mesh(job: dict[str, Any], arrays: Arrays, tick: Tick) -> tuple[dict[str, Any], Arrays]:
    """Write the mesh to `job["path"]`, a temporary name, and check what arrived there."""
    path, suffix = Path(job["path"]), job["suffix"]
    v: F64 = arrays["vertices"]
    f: I64 = arrays["faces"]
    tick(0.1, "Writing")
    # Native code gets a plain ASCII name in the current folder: it knows no other ones everywhere.
    os.chdir(path.parent)
    write_as(suffix, path.name, v, f)
    tick(0.6, "Reading back")
    with open(path, "rb+") as written:
        os.fsync(written.fileno())
    _compare(path, suffix, v, f, job["name"])
    return {"size": path.stat().st_size}, {}


def write_as(suffix: str, name: str, v: F64, f: I64) -> None:
    """Write the file `name` in the format of `suffix`."""
    if suffix == ".obj":
        _write_text(name, "", "v %.17g %.17g %.17g\n", v, "f %d %d %d\n", f + 1)
    elif suffix == ".off":
        _write_text(name, f"OFF\n{len(v)} {len(f)} 0\n", "%.17g %.17g %.17g\n", v, "3 %d %d %d\n", f)
    else:
        _write_native(suffix, name, v, f)


def _write_text(name: str, head: str, vertex: str, v: F64, face: str, f: I64) -> None:
    """Write text with 17 digits, which any reader turns into the same double again."""
    with open(name, "w", encoding="ascii", newline="\n") as out:
        out.write(head)
        for rows, line in ((v, vertex), (f, face)):
            for block in np.array_split(rows, max(1, len(rows) // 50_000)):
                out.write((line * len(block)) % tuple(block.ravel().tolist()))


def _write_native(suffix: str, name: str, v: F64, f: I64) -> None:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(v, f.astype(np.int32)))
    options: dict[str, Any] = {}
    if suffix == ".ply":
        options = {
            "binary": True, "save_vertex_quality": False, "save_vertex_color": False,
            "save_vertex_normal": False, "save_face_quality": False, "save_face_color": False,
        }  # fmt: skip
    try:
        meshes.save_current_mesh(name, **options)
    except pymeshlab.PyMeshLabException as error:
        raise FileError(f"The file could not be written ({error}).") from error


def _compare(path: Path, suffix: str, v: F64, f: I64, name: str) -> None:
    """Read the written file back and compare counts, positions and bounding box."""
    data = path.read_bytes()
    got_v, got_f, notes = settle(read_soup(Path(path.name), data), path.name)
    lost = [n for n in notes if n.lost]
    scale = float(np.abs(v).max())
    same = len(got_f) == len(f) and not lost
    if same and suffix != ".stl":
        same = len(got_v) == len(v) and bool((got_f == f).all())
    if same:
        off = np.abs(got_v[got_f] - v[f]).max()
        same = bool(off <= PRECISION[suffix] * scale)
    if not same:
        raise FileError(
            f"“{name}” was not saved: what was written did not read back as the same mesh. "
            "Try another format, or another disk."
        )
