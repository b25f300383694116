"""3DS: chunks within chunks; objects of vertices and triangles, in the scene's coordinates."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from engine.files.gathered import Gathered, Piece
from engine.files.soup import Soup, damaged
from engine.files.text import U8

_MAIN, _EDITOR, _OBJECT, _MESH, _VERTICES, _FACES = (
    0x4D4D, 0x3D3D, 0x4000, 0x4100, 0x4110, 0x4120,
)  # fmt: skip
_HEAD = 6

Span = tuple[int, int]


def scan_3ds(data: bytes, name: str) -> Soup:
    """Return the triangles of all objects; a 3DS holds single precision.

    Raises
    ------
    FileError
        A chunk reaches beyond the one that holds it, or holds less than it announces.
    """
    gathered = Gathered(name)
    for whole in _chunks(data, (0, len(data)), _MAIN, name):
        for editor in _chunks(data, whole, _EDITOR, name):
            for item in _chunks(data, editor, _OBJECT, name):
                end_of_name = data.find(b"\0", *item)
                if end_of_name < 0:
                    raise damaged(name, "the name of an object does not end")
                for mesh in _chunks(data, (end_of_name + 1, item[1]), _MESH, name):
                    gathered.place(_piece(data, mesh, name), np.eye(4))
    return gathered.soup("3DS", [])


def _chunks(data: bytes, span: Span, kind: int, name: str) -> Iterator[Span]:
    """Give the contents of the chunks of one kind that lie directly in `span`."""
    at, end = span
    while at + _HEAD <= end:
        found = int.from_bytes(data[at : at + 2], "little")
        length = int.from_bytes(data[at + 2 : at + _HEAD], "little")
        if length < _HEAD or at + length > end:
            raise damaged(name, "its parts do not fit into each other")
        if found == kind:
            yield at + _HEAD, at + length
        at += length
    if at != end and end < len(data):
        raise damaged(name, "there are bytes between its parts that belong to none")


def _piece(data: bytes, mesh: Span, name: str) -> Piece:
    """Return the mesh of one object."""
    rows: list[U8] = []
    for kind, width, what in ((_VERTICES, 12, "vertices"), (_FACES, 8, "faces")):
        found = list(_chunks(data, mesh, kind, name))
        if len(found) > 1:
            raise damaged(name, f"an object has its {what} twice")
        rows.append(
            _table(data, found[0], width, what, name) if found else np.empty((0, width), np.uint8)
        )
    vertices = rows[0].view("<f4").astype(np.float64)
    faces = rows[1].view("<u2")[:, :3].astype(np.int64)
    return Piece(vertices, faces.ravel(), np.full(len(faces), 3))


def _table(data: bytes, span: Span, width: int, what: str, name: str) -> U8:
    """Return the rows of a chunk that begins with their number, as bytes (n, width)."""
    at, end = span
    count = int.from_bytes(data[at : at + 2], "little")
    if end - at < 2 or at + 2 + count * width > end:
        held = max(0, end - at - 2) // width
        raise damaged(name, f"an object announces {count:,} {what} and has room for {held:,}")
    if what == "vertices" and at + 2 + count * width != end:
        raise damaged(name, f"an object holds more bytes of {what} than it announces")
    return np.frombuffer(data, np.uint8, count * width, at + 2).reshape(count, width)
