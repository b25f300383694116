"""glTF and PLY with strips: checked from outside, then read by pymeshlab."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.gltf import check_gltf, without_materials
from engine.files.report import Change, counted, shown
from engine.files.scratch import scratch_folder
from engine.files.soup import Soup

has_read = False
"""Whether this process has had pymeshlab read a stranger's file."""

_SUFFIX = {"glTF": ".gltf", "PLY": ".ply"}


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
