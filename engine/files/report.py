"""What was found in a file, what was repaired, and what was lost: as data and in plain words."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

# How far a coordinate may be off after export, relative to the largest one: 0 is to the last bit.
PRECISION = {
    ".obj": 0.0, ".ply": 0.0, ".stl": 2.0**-23, ".off": 0.0, ".3mf": 0.0, ".glb": 2.0**-23,
}  # fmt: skip
# What the worker says it does while the file is coming, and while native filters run.
READING = "Reading"
CLEANING = "Cleaning"
FACE_WARNING = 0.02
# They join letters and the parts of pictures in names, and mislead nobody.
_JOINERS = "\u200c\u200d"
AREA_WARNING = 0.01


@dataclass(frozen=True)
class Change:
    """One thing that differs from the file as it was written.

    Parameters
    ----------
    what : a short key such as "duplicate_vertices".
    words : one plain sentence.
    vertices, faces : how many vertices and faces it removed, added or changed.
    lost : the file held this and it is not in the mesh any more, in any form.
    """

    what: str
    words: str
    vertices: int = 0
    faces: int = 0
    lost: bool = False


@dataclass(frozen=True)
class ImportReport:
    """How a file became a mesh.

    Parameters
    ----------
    name : file name without folder.
    format : "OBJ", "PLY", ...: by content, whatever the name says.
    declared_vertices, declared_faces : what the file says it holds (faces may be polygons).
    vertices, faces : what the mesh holds (triangles).
    reading : notes and losses while reading; these happen with and without cleanup.
    repairs : what cleanup did.
    warnings : what the person should know before going on.
    """

    name: str
    format: str
    declared_vertices: int
    declared_faces: int
    vertices: int
    faces: int
    reading: tuple[Change, ...] = ()
    repairs: tuple[Change, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether the mesh differs from what the file holds."""
        return bool(self.repairs) or any(c.vertices or c.faces or c.lost for c in self.reading)

    @property
    def lost(self) -> tuple[Change, ...]:
        """The changes by which something in the file is not in the mesh."""
        return tuple(c for c in (*self.reading, *self.repairs) if c.lost)

    def lines(self) -> list[str]:
        """Return the report in plain words, one sentence or two a line."""
        head = (
            f"{self.name}: {self.format}, {counted(self.vertices, 'vertex')}, "
            f"{counted(self.faces, 'triangle')}."
        )
        found = [c.words for c in (*self.reading, *self.repairs)]
        return [head, *(found or ["Nothing had to be repaired."]), *self.warnings]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON data."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> ImportReport:
        """Build the report from what `to_json` gave."""
        plain = {f.name: data[f.name] for f in fields(cls)}
        for key in ("reading", "repairs"):
            plain[key] = tuple(Change(**c) for c in plain[key])
        plain["warnings"] = tuple(plain["warnings"])
        return cls(**plain)


@dataclass(frozen=True)
class ExportReport:
    """What was saved.

    Parameters
    ----------
    name : file name without folder.
    vertices, faces : as many as the mesh has.
    size : bytes on the disk.
    precision : how far a coordinate may be off, relative to the largest; 0 is to the last bit.
    """

    name: str
    vertices: int
    faces: int
    size: int
    precision: float

    def lines(self) -> list[str]:
        """Return the report in plain words."""
        lines = [
            f"{self.name}: {counted(self.vertices, 'vertex')}, {counted(self.faces, 'triangle')}, "
            f"{self.size / 1e6:.1f} MB; read back and found the same."
        ]
        if self.precision:
            lines.append(
                "This format holds coordinates in single precision (7 digits): "
                "keep an OBJ or PLY for further work."
            )
        return lines


def shown(name: str) -> str:
    """Return a file name on one line that can be printed, with “?” for what cannot be said so.

    That is what no encoding knows, line ends, and marks that turn the direction of reading.
    """
    text = name.encode("utf-8", "replace").decode()
    return "".join(c if c.isprintable() or c in _JOINERS else "?" for c in text)


def counted(count: int, noun: str) -> str:
    """Return "1 vertex", "2 vertices", "1,200 faces": a number with its noun."""
    plural = {"vertex": "vertices", "index": "indices"}.get(noun, noun + "s")
    return f"{count:,} {noun if count == 1 else plural}"
