"""Import, in the worker: bytes to a mesh that can be trusted, and the report of how."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from engine.errors import FileError
from engine.files.cleanup import clean_up
from engine.files.defects import flat_faces
from engine.files.native import read_native
from engine.files.place import read_whole
from engine.files.report import CLEANING, FACE_WARNING, READING, Change, ImportReport
from engine.files.scan_3ds import scan_3ds
from engine.files.scan_3mf import scan_3mf
from engine.files.scan_dae import scan_dae
from engine.files.scan_obj import scan_obj
from engine.files.scan_off import scan_off
from engine.files.scan_ply import StripsError, scan_ply
from engine.files.scan_stl import scan_stl
from engine.files.scan_x3d import scan_x3d
from engine.files.sniff import sniff
from engine.files.soup import Soup, settle
from engine.files.wire import Arrays

_SCANNERS: dict[str, Callable[[bytes, str], Soup]] = {
    "OBJ": scan_obj, "STL": scan_stl, "OFF": scan_off, "3MF": scan_3mf, "DAE": scan_dae,
    "X3D": scan_x3d, "3DS": scan_3ds,
}  # fmt: skip
Tick = Callable[[float, str], None]


def import_file(job: dict[str, Any], _: Arrays, tick: Tick) -> tuple[dict[str, Any], Arrays]:
    """Read `job["path"]`; answer with the mesh as read and, where that differs, as cleaned."""
    path, name = Path(job["path"]), job["name"]
    tick(0.05, READING)
    soup = read_soup(path, read_whole(path, name, lambda: tick(0.05, READING)), name)
    tick(0.4, "Checking")
    v, f, reading = settle(soup, name)
    if flat_faces(v, f).all():
        raise FileError(
            f"“{name}” has no face with an area, so there is no surface to open. "
            "Export the model again as a triangle mesh."
        )
    arrays = {"vertices": v, "faces": f}
    warnings = _warnings(soup, reading)
    report = ImportReport(
        name, soup.format, soup.declared_vertices, soup.declared_faces, len(v), len(f),
        tuple(reading), (), warnings,
    )  # fmt: skip
    answer: dict[str, Any] = {"read": report.to_json(), "cleaned": None}
    if job["clean"]:
        tick(0.5, CLEANING)
        made = clean_up(v, f, lambda done: tick(0.5 + 0.4 * done, CLEANING))
        cleaned = ImportReport(
            name, soup.format, soup.declared_vertices, soup.declared_faces,
            len(made.vertices), len(made.faces),
            tuple(reading), made.repairs, (*warnings, *made.warnings),
        )  # fmt: skip
        answer["cleaned"] = cleaned.to_json()
        if made.repairs:
            arrays |= {"clean_vertices": made.vertices, "clean_faces": made.faces}
    tick(0.95, "Handing over")
    return answer, arrays


def _warnings(soup: Soup, reading: list[Change]) -> tuple[str, ...]:
    """Return what to be warned of after reading: much was lost, or what is there may be wrong."""
    found = []
    lost = sum(change.faces for change in reading if change.lost)
    if lost > FACE_WARNING * soup.declared_faces:
        share = lost / soup.declared_faces
        found.append(f"{share:.1%} of the file's faces are not in the mesh: look before you go on.")
    if soup.format == "OBJ" and any(c.what in ("bad_index", "unknown_lines") for c in reading):
        found.append(
            "The file may have lost vertices, and faces may then join wrong ones: "
            "compare with the original."
        )
    return tuple(found)


def read_soup(path: Path, data: bytes, name: str) -> Soup:
    """Return what the file holds, by the scanner of its format; the content decides which."""
    kind = sniff(data, name)
    if kind in _SCANNERS:
        return _SCANNERS[kind](data, name)
    if kind == "PLY":
        try:
            return scan_ply(data, name)
        except StripsError:
            return read_native(path, data, kind, name)
    return read_native(path, data, kind, name)
