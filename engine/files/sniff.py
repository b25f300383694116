"""Which format a file is in, by its content; the name decides only where the content does not."""

from __future__ import annotations

import re
from pathlib import PurePath

import numpy as np

from engine.errors import FileError
from engine.files.text import plain_text

_BY_SUFFIX = {
    ".obj": "OBJ", ".ply": "PLY", ".stl": "STL", ".off": "OFF", ".3mf": "3MF", ".gltf": "glTF",
    ".glb": "glTF", ".dae": "DAE", ".3ds": "3DS", ".x3d": "X3D",
}  # fmt: skip
_OBJ_LINE = re.compile(rb"^\s*v[ \t]+[-+.\dnNiI]", re.MULTILINE)
_OBJ_FACE = re.compile(rb"^\s*f[ \t]+[-\d\\]", re.MULTILINE)
_OFF_HEAD = re.compile(rb"\A\s*(#[^\n]*\n\s*)*(?:ST|C|N)*4?n?OFF\b", re.IGNORECASE)


def sniff(data: bytes, name: str) -> str:
    """Return "OBJ", "PLY", "STL", "OFF", "3MF", "glTF", "DAE", "3DS" or "X3D".

    Raises
    ------
    FileError
        The content is none of these; the sentence says what it looks like.
    """
    found = _by_content(data)
    if found in _BY_SUFFIX.values():
        return found
    if found:
        raise FileError(
            f"“{name}” is {found}, not a mesh. Look where it came from and get the model itself."
        )
    suffix = PurePath(name).suffix.lower()
    known = _BY_SUFFIX.get(suffix)
    if known is None:
        raise FileError(
            f"“{name}” is of no format that can be read. Save it as OBJ, PLY, STL, OFF or 3MF."
        )
    if (known == "STL" and len(data) < 84) or known in ("PLY", "3MF", "glTF", "DAE", "X3D"):
        raise FileError(
            f"“{name}” is not {_article(known)} file, although its name says so. "
            "Look where it came from and get the model itself."
        )
    if known in ("OBJ", "OFF") and _mostly_binary(data):
        raise FileError(
            f"“{name}” holds binary data and no {known} text. Get another copy of the file."
        )
    return known


def _article(kind: str) -> str:
    return ("an " if kind[0] in "OX" or kind == "STL" else "a ") + kind


def _by_content(data: bytes) -> str:
    if data[:4] == b"PK\x03\x04":
        return "3MF" if b"3D/" in data[:65536] or b".model" in data else "a ZIP archive"
    if data[:4] == b"glTF":
        return "glTF"
    if data[:2] == b"MM" and int.from_bytes(data[2:6], "little") in range(6, len(data) + 1):
        return "3DS"
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return "STL"
    head = plain_text(data[: 1 << 16])[0]
    start = head.lstrip()[:2000]
    lowered = start.lower()
    if lowered.startswith(b"ply"):
        return "PLY"
    if _OFF_HEAD.match(head):
        return "OFF"
    if lowered.startswith((b"<!doctype html", b"<html")):
        return "a web page"
    if lowered.startswith((b"<?xml", b"<")):
        return _by_root(head)
    if lowered.startswith(b"{") and b'"asset"' in head:
        return "glTF"
    if lowered.startswith(b"solid") and b"facet" in head.lower():
        return "STL"
    if _OBJ_LINE.search(head) or _OBJ_FACE.search(head):
        return "OBJ"
    if data.startswith(b"%PDF"):
        return "a PDF document"
    if data.startswith((b"\x89PNG", b"\xff\xd8\xff", b"GIF8")):
        return "a picture"
    return ""


def _by_root(head: bytes) -> str:
    for mark, kind in ((b"<COLLADA", "DAE"), (b"<X3D", "X3D"), (b"<html", "a web page")):
        if mark in head or mark.lower() in head.lower():
            return kind
    return "an XML text"


def _mostly_binary(data: bytes) -> bool:
    head = np.frombuffer(data[:4096], np.uint8)
    control = (head < 9) | ((head > 13) & (head < 32))
    return bool(len(head)) and float(control.mean()) > 0.02
