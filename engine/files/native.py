"""glTF, DAE, 3DS and X3D, experimentally: checked from outside, then read by pymeshlab."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.gltf import check_gltf, without_materials
from engine.files.markup import read_markup
from engine.files.report import Change, counted, shown
from engine.files.scratch import scratch_folder
from engine.files.soup import Soup

has_read = False
"""Whether this process has had pymeshlab read a stranger's file."""

_SUFFIX = {"glTF": ".gltf", "DAE": ".dae", "3DS": ".3ds", "X3D": ".x3d", "PLY": ".ply"}


def read_native(path: Path, data: bytes, kind: str, name: str) -> Soup:
    """Return what pymeshlab reads of the file, after checks that keep the worst from it.

    Raises
    ------
    FileError
        A check failed, or pymeshlab cannot read it or finds no surface in it.
    """
    companions: list[str] = []
    faces = 0
    suffix = _SUFFIX[kind]
    if kind == "glTF":
        faces, companions = check_gltf(data, name)
        data = without_materials(data)
        suffix = ".glb" if data[:4] == b"glTF" else suffix
    elif kind in ("DAE", "X3D"):
        faces = _triangles_announced(data, name)
    elif kind == "3DS":
        faces = _check_chunks(data, name)
    v, f = _loaded(path, data, suffix, companions, name)
    if len(f) == 0 and faces:
        raise FileError(
            f"“{name}” announces {counted(faces, 'face')}, and none of them can be read: its "
            "coordinates may not be finite numbers. Save it as OBJ, PLY or STL."
        )
    notes = [
        Change("experimental", f"{kind} is read experimentally, in single precision: compare with "
               "the original.")
    ]  # fmt: skip
    if len(f) < faces:
        lost = faces - len(f)
        notes.append(Change("not_read", f"{counted(lost, 'face')} of {faces:,} were not read.",
                            faces=lost, lost=True))  # fmt: skip
    return Soup(kind, v, f.ravel(), np.full(len(f), 3), len(v), max(faces, len(f)), notes)


def _loaded(
    path: Path, data: bytes, suffix: str, companions: list[str], name: str
) -> tuple[F64, I64]:
    """Let pymeshlab read a copy under a plain name, in a folder that holds nothing else.

    The copy keeps names that native code cannot open from it, and references out of the folder.
    """
    import pymeshlab

    global has_read
    home = Path.cwd()
    with scratch_folder() as folder:
        try:
            os.chdir(folder)
            Path("model" + suffix).write_bytes(data)
            for companion in companions:
                _bring(path, companion, name)
            meshes = pymeshlab.MeshSet(verbose=False)
            has_read = True
            meshes.load_new_mesh("model" + suffix)
            if len(meshes) > 1:
                meshes.generate_by_merging_visible_meshes(
                    mergevisible=True, deletelayer=True, mergevertices=False, alsounreferenced=True
                )
            mesh = meshes.current_mesh()
            return np.array(mesh.vertex_matrix()), mesh.face_matrix().astype(np.int64)
        except pymeshlab.PyMeshLabException as error:
            raise FileError(
                f"“{name}” cannot be read ({_first_line(error)}). "
                "Save it as OBJ, PLY or STL in the program that made it."
            ) from None
        finally:
            os.chdir(home)


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = lines[-1].removeprefix("Error details:").strip(" .") if lines else "no reason given"
    return reason[:1].lower() + reason[1:]


def _bring(path: Path, companion: str, name: str) -> None:
    """Copy a file that a glTF refers to, from the glTF's own folder only."""
    folder = path.parent.resolve()
    try:
        source = (folder / companion).resolve()
        there = folder in source.parents and source.is_file()
        if there:
            Path(companion).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, companion)
    except (OSError, ValueError, RuntimeError):
        # Too long a name, one with a zero byte, a link that leads in a circle.
        there = False
    if not there:
        raise FileError(
            f"“{name}” needs the file “{shown(companion[:60])}” beside it, which is not there. "
            "Copy both into one folder, or save it as GLB."
        )


def _triangles_announced(data: bytes, name: str) -> int:
    total = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal total
        if tag in ("triangles", "polylist", "polygons"):
            count = attributes.get("count", "0")
            total += int(count) if count.isascii() and count.isdigit() and len(count) < 10 else 0

    read_markup(data, name, start)
    return total


_CONTAINERS = {0x4D4D, 0x3D3D, 0x4000, 0x4100}


def _check_chunks(data: bytes, name: str) -> int:
    """Return how many faces a 3DS announces, after checking that its chunks fit into each other."""
    faces = 0
    waiting = [(0, len(data))]
    while waiting:
        at, end = waiting.pop()
        while at + 6 <= end:
            kind = int.from_bytes(data[at : at + 2], "little")
            length = int.from_bytes(data[at + 2 : at + 6], "little")
            if length < 6 or at + length > end:
                raise _chunk_error(name)
            inside = at + 6
            if kind == 0x4000:
                stop = data.find(b"\0", inside, at + length)
                if stop < 0:
                    raise _chunk_error(name)
                inside = stop + 1
            if kind in (0x4110, 0x4120):
                count = int.from_bytes(data[inside : inside + 2], "little")
                if inside + 2 + count * (12 if kind == 0x4110 else 8) > at + length:
                    raise _chunk_error(name)
                faces += count if kind == 0x4120 else 0
            if kind in _CONTAINERS:
                waiting.append((inside, at + length))
            at += length
    return faces


def _chunk_error(name: str) -> FileError:
    return FileError(
        f"“{name}” is damaged: its parts do not fit into each other. "
        "Export the model again or get another copy of the file."
    )
