"""The door for files: open, clean, save. Everything native happens in a process of its own.

OBJ, PLY, STL, OFF, 3MF, DAE, X3D and 3DS are scanned by `engine.files.scan_*`: on arrays, to the
last bit, with every loss counted. pymeshlab's own readers ended or hung the process on one damaged
file in 25, and read byte order marks, decimal commas and index 0 wrongly without a word; it cleans,
remeshes and reads glTF, in the worker process.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from engine.errors import FileError
from engine.files import limits
from engine.files.limits import MEMORY as MEMORY_LIMIT
from engine.files.limits import memory_needed
from engine.files.place import beside, put_in_place, readable_size, sweep_strays
from engine.files.process import WorkerDiedError, WorkerLostError, WorkerSlowError, worker
from engine.files.report import CLEANING, PRECISION, Change, ExportReport, ImportReport, shown
from engine.mesh import Mesh
from engine.run import Run

__all__ = [
    "EXPORT_SUFFIXES",
    "IMPORT_SUFFIXES",
    "MEMORY_LIMIT",
    "Change",
    "ExportReport",
    "ImportReport",
    "Imported",
    "estimate",
    "load",
    "open_file",
    "save",
    "start_worker",
    "sweep_strays",
]

EXPORT_SUFFIXES = tuple(PRECISION)
EXPERIMENTAL_SUFFIXES = (".gltf", ".glb", ".dae", ".3ds", ".x3d")
IMPORT_SUFFIXES = (".obj", ".ply", ".stl", ".off", ".3mf", *EXPERIMENTAL_SUFFIXES)


@dataclass(frozen=True, eq=False)
class Imported:
    """A file that was opened.

    Parameters
    ----------
    mesh : the mesh, cleaned if that was asked for.
    report : what was found, lost and repaired.
    as_read : the mesh before cleanup; the same object as `mesh` where nothing was repaired.
    report_as_read : the report that goes with `as_read`.
    """

    mesh: Mesh
    report: ImportReport
    as_read: Mesh
    report_as_read: ImportReport

    @property
    def without_repairs(self) -> Imported:
        """The same file with its repairs declined."""
        return replace(self, mesh=self.as_read, report=self.report_as_read)


def load(path: str | os.PathLike[str], run: Run | None = None) -> Mesh:
    """Return the mesh of a file, cleaned. `open_file` says what was done to it.

    Raises
    ------
    FileError
        The file cannot be read; the message names it, says why and what to do.
    """
    return open_file(path, run=run).mesh


def open_file(path: str | os.PathLike[str], clean: bool = True, run: Run | None = None) -> Imported:
    """Open a mesh file in the worker process and report how it went.

    A file without defects gives its own vertices in its own order, to the last bit of what it holds
    (an STL, which has corners only, gives each place once, in the order of first appearance).

    Parameters
    ----------
    path : OBJ, PLY, STL, OFF or 3MF (glTF, DAE, 3DS and X3D experimentally); the content decides
        about the format, not the name.
    clean : mend duplicates, unreferenced vertices, degenerate and non-manifold faces, orientation.
    run : progress and cancel.

    Raises
    ------
    FileError
        The file cannot be read; the message names it, says why and what to do.
    """
    place = Path(path)
    size = readable_size(place)
    _refuse_too_large(place, size)
    try:
        return _import(place, size, clean, run)
    except WorkerLostError as lost:
        if not clean or lost.stage != CLEANING:
            raise _given_up(shown(place.name), size, lost) from None
    try:
        found = _import(place, size, False, run)
    except WorkerLostError as lost:
        raise _given_up(shown(place.name), size, lost) from None
    words = "Cleanup could not cope with this mesh and was left out: look before you go on."
    report = replace(found.report, warnings=(*found.report.warnings, words))
    return replace(found, report=report)


def _import(place: Path, size: int, clean: bool, run: Run | None) -> Imported:
    job = {
        "job": "import",
        "path": str(place.absolute()),
        "name": shown(place.name),
        "clean": clean,
    }
    answer, arrays = worker.ask(job, None, limits.seconds_for(size), run)
    as_read = Mesh(arrays["vertices"], arrays["faces"])
    read_report = ImportReport.from_json(answer["read"])
    if answer["cleaned"] is None:
        return Imported(as_read, read_report, as_read, read_report)
    cleaned = as_read
    if "clean_vertices" in arrays:
        cleaned = Mesh(arrays["clean_vertices"], arrays["clean_faces"])
    return Imported(cleaned, ImportReport.from_json(answer["cleaned"]), as_read, read_report)


def _given_up(name: str, size: int, lost: WorkerLostError) -> FileError:
    if isinstance(lost, WorkerSlowError):
        return FileError(
            f"“{name}” took longer than {limits.seconds_for(size):.0f} seconds to read and was "
            "given up. Save it as binary PLY or with fewer faces."
        )
    if isinstance(lost, WorkerDiedError) and lost.killed:
        return FileError(
            f"“{name}” could not be read: twice the system ended the process that reads it, as it "
            "does when memory runs out. Close other programs and open it again."
        )
    return FileError(
        f"“{name}” could not be read: its content stopped the reader. "
        "Export the model again, or open and save it in the program that made it."
    )


def save(mesh: Mesh, path: str | os.PathLike[str], run: Run | None = None) -> ExportReport:
    """Write a mesh; whatever goes wrong, a file that was there before stays whole.

    It is written beside under another name, pushed to the disk, read back and compared, and only
    then renamed. OBJ, OFF and 3MF (17 digits) and PLY (binary) keep double precision and the order
    of vertices and faces. STL and GLB hold single precision only; STL keeps the faces' order alone.

    Raises
    ------
    FileError
        It could not be saved; the message names the file, says why and what to do.
    """
    target = Path(path)
    name, suffix = shown(target.name), target.suffix.lower()
    if suffix not in EXPORT_SUFFIXES:
        raise FileError(
            f"“{name}” names no format that can be written. "
            f"Choose a name that ends in {', '.join(EXPORT_SUFFIXES)}."
        )
    with beside(target, suffix) as part:
        job = {"job": "export", "path": str(part.absolute()), "suffix": suffix, "name": name}
        arrays = {"vertices": mesh.vertices, "faces": mesh.faces}
        try:
            answer, _ = worker.ask(job, arrays, limits.seconds_for(200 * len(mesh.faces)), run)
        except WorkerLostError:
            raise FileError(
                f"“{name}” was not saved: the writer stopped. What was there before is unchanged; "
                "see whether the disk is full, or choose another format."
            ) from None
        put_in_place(part, target)
    return ExportReport(name, mesh.n, len(mesh.faces), answer["size"], PRECISION[suffix])


def estimate(path: str | os.PathLike[str]) -> int:
    """Return about how many bytes of memory opening a file takes at its peak, without reading it.

    Measured on files of half a million faces; `MEMORY_LIMIT` is what the worker may use at most.

    Raises
    ------
    FileError
        The file is not there, or no ordinary file.
    """
    place = Path(path)
    return memory_needed(place, readable_size(place))


def start_worker() -> None:
    """Start the worker process in the background, so that the first file opens quickly."""
    worker.start()


def _refuse_too_large(place: Path, size: int) -> None:
    needed = memory_needed(place, size)
    if needed > MEMORY_LIMIT:
        raise FileError(
            f"“{shown(place.name)}” would take about {needed / 2**30:.0f} GiB of memory to open, "
            f"and {MEMORY_LIMIT / 2**30:.0f} GiB is the most that is used. "
            "Save it with fewer faces, or as binary PLY."
        )
