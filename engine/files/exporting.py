"""Export, in the worker: written under another name, pushed to the disk, and read back."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from engine.arrays import F64, I64
from engine.errors import EngineError, FileError
from engine.files.importing import read_soup
from engine.files.place import sentence
from engine.files.report import PRECISION
from engine.files.rows import formatted
from engine.files.soup import settle
from engine.files.wire import Arrays
from engine.files.write_3mf import write_3mf

Tick = Callable[[float, str], None]

_LITTLE_ROOM = 1 << 20


def export_mesh(job: dict[str, Any], arrays: Arrays, tick: Tick) -> tuple[dict[str, Any], Arrays]:
    """Write the mesh to `job["path"]`, a temporary name, and check what arrived there."""
    path, suffix, name = Path(job["path"]), job["suffix"], job["name"]
    v: F64 = arrays["vertices"]
    f: I64 = arrays["faces"]
    try:
        # Native code gets a plain name in the current folder: it cannot open every path.
        os.chdir(path.parent)
        tick(0.1, "Writing")
        write_as(suffix, path.name, v, f, name)
        # Reading back would find what is still in memory; the disk must have taken it first.
        with Path(path.name).open("rb+") as written:
            os.fsync(written.fileno())
        tick(0.6, "Reading back")
        if not _reads_back(Path(path.name), suffix, v, f):
            raise FileError(
                _not_written(name, "what was written did not read back as the same mesh")
            )
        return {"size": Path(path.name).stat().st_size}, {}
    except OSError as error:
        raise FileError(sentence(name, error)) from error
    finally:
        # A folder that is somebody's current one cannot be removed or unmounted. To ask for the
        # folder of temporary files would write one, which a full disk refuses.
        os.chdir(Path(__file__).parent)


def write_as(suffix: str, name: str, v: F64, f: I64, told: str) -> None:
    """Write the file `name` in the format of `suffix`; a refusal calls it `told`."""
    if suffix == ".obj":
        _write_text(name, "", "v %.17g %.17g %.17g\n", v, "f %d %d %d\n", f + 1)
    elif suffix == ".off":
        _write_text(
            name, f"OFF\n{len(v)} {len(f)} 0\n", "%.17g %.17g %.17g\n", v, "3 %d %d %d\n", f
        )
    elif suffix == ".3mf":
        write_3mf(name, v, f)
    elif suffix == ".glb":
        _write_glb(name, v, f, told)
    elif suffix == ".ply":
        _write_ply(name, v, f)
    else:
        _write_stl(name, v, f)


def _write_text(name: str, head: str, vertex: str, v: F64, face: str, f: I64) -> None:
    """Write text with 17 digits, which any reader turns into the same double again.

    pymeshlab's own writers stop at 15 or 16 digits.
    """
    with Path(name).open("wb") as out:
        out.write(head.encode())
        for line, rows in ((vertex, v), (face, f)):
            out.writelines(formatted(line, rows))


def _write_glb(name: str, v: F64, f: I64, told: str) -> None:
    try:
        import trimesh
    except ImportError:
        raise FileError(
            f"“{told}” was not saved: writing glTF needs the package trimesh. "
            "Install it, or choose another format."
        ) from None
    mesh = trimesh.Trimesh(v, f, process=False)
    content: Any = mesh.export(file_type="glb", include_normals=False)
    Path(name).write_bytes(content)


def _write_ply(name: str, v: F64, f: I64) -> None:
    """Write binary PLY with positions in double precision."""
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(v)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(f)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(f), dtype=[("size", "u1"), ("corners", "<i4", 3)])
    rows["size"], rows["corners"] = 3, f
    with Path(name).open("wb") as out:
        out.write(head.encode())
        out.write(np.ascontiguousarray(v, dtype="<f8").data)
        out.write(rows.view(np.uint8).data)


def _write_stl(name: str, v: F64, f: I64) -> None:
    """Write binary STL: single precision, with the faces' normals."""
    corners = v[f]
    row = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]
    rows = np.zeros(len(f), dtype=row)
    # What single precision cannot hold is found when the file is read back.
    with np.errstate(over="ignore", invalid="ignore"):
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        np.divide(normals, lengths, out=normals, where=lengths > 0)
        rows["normal"], rows["corners"] = normals, corners
    with Path(name).open("wb") as out:
        out.write(b"Eigenform".ljust(80) + len(f).to_bytes(4, "little"))
        out.write(rows.view(np.uint8).data)


def _reads_back(path: Path, suffix: str, v: F64, f: I64) -> bool:
    """Return whether the written file holds the same mesh: counts, positions and bounding box."""
    try:
        soup = read_soup(path, path.read_bytes(), path.name)
        got_v, got_f, notes = settle(soup, path.name)
    except EngineError:
        return False
    if len(got_f) != len(f) or any(note.lost for note in notes):
        return False
    if suffix != ".stl" and (len(got_v) != len(v) or not (got_f == f).all()):
        return False
    off = np.abs(got_v[got_f] - v[f]).max()
    return bool(off <= PRECISION[suffix] * np.abs(v).max())


def _not_written(name: str, fact: str) -> str:
    """Return what to tell when the file is not right: mostly the disk is full, untold."""
    remedy = "Try another format or another disk"
    if shutil.disk_usage(".").free < _LITTLE_ROOM:
        fact, remedy = "the disk is full", "Make room or choose another disk"
    return f"“{name}” was not saved: {fact}. {remedy}; what was there before is unchanged."
