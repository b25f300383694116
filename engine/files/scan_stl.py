"""STL, binary and text: a triangle soup whose equal corners are joined while it is read."""

from __future__ import annotations

import re

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.defects import places
from engine.files.report import Change, counted
from engine.files.soup import Soup
from engine.files.text import Tokens, decimals, plain_text, tokenise

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84
_KNOWN = b"solid facet outer loop vertex endloop endfacet endsolid color".split()
_WORD = re.compile(rb"\s((?:end)?(?:solid|facet)|outer|vertex|endloop)(?=\s|\Z)", re.IGNORECASE)


def scan_stl(data: bytes, name: str) -> Soup:
    """Return what an STL holds, as text or binary by content.

    A binary file may begin with "solid" too: it is binary when its length fits its count.
    """
    if _length_fits(data) or not _looks_like_text(data):
        return _binary(data, name)
    return _ascii(data, name)


def _declared(data: bytes) -> int:
    return int.from_bytes(data[80:84], "little")


def _length_fits(data: bytes) -> bool:
    return len(data) >= _HEAD and len(data) == _HEAD + _RECORD.itemsize * _declared(data)


def _looks_like_text(data: bytes) -> bool:
    head = plain_text(data[:2048])[0].lower()
    return b"facet" in head or (b"solid" in head[:80] and b"\0" not in head)


def _binary(data: bytes, name: str) -> Soup:
    notes: list[Change] = []
    if len(data) < _HEAD:
        raise FileError(f"“{name}” is too short for an STL file. Get another copy of the file.")
    declared, there = _declared(data), (len(data) - _HEAD) // _RECORD.itemsize
    whole = len(data) == _HEAD + there * _RECORD.itemsize
    if there < declared:
        raise FileError(
            f"“{name}” is cut off or damaged: its header announces "
            f"{counted(declared, 'triangle')}, and there are bytes for {there:,}. "
            "Export the model again or get another copy."
        )
    if there > declared and not whole:
        raise FileError(
            f"“{name}” is damaged: its header announces {counted(declared, 'triangle')}, but its "
            f"length fits no number of triangles. Export the model again or get another copy."
        )
    if there > declared:
        notes.append(
            Change(
                "count_low",
                f"The header announces {counted(declared, 'triangle')}, but the "
                f"file holds {there:,}; all of them were read.",
            )
        )
    records = np.frombuffer(data, _RECORD, count=there, offset=_HEAD)
    return _welded(records["corners"].reshape(-1, 3).astype(np.float64), there, declared, notes)


def _ascii(data: bytes, name: str) -> Soup:
    text, notes = plain_text(data)
    tokens = tokenise(text)
    if not tokens.are(tokens.first[:-1], b"vertex").any():
        # A few programs write a triangle, or all of them, on one line.
        tokens = tokenise(_WORD.sub(rb"\n\1", text))
    heads = tokens.first[:-1]
    notes += _unknown_lines(tokens)
    is_facet = tokens.are(heads, b"facet")
    lines = np.flatnonzero(tokens.are(heads, b"vertex"))
    facets = int(is_facet.sum())
    of_facet = np.cumsum(is_facet)[lines] - 1
    points = np.full((len(lines), 3), np.nan)
    enough = tokens.lengths[lines] == 4
    words = tokens.first[lines[enough], None] + np.array([1, 2, 3])
    points[enough] = decimals(tokens, words.ravel()).reshape(-1, 3)
    held = np.bincount(of_facet[of_facet >= 0], minlength=facets)
    right = held == 3
    if not right.all() or (of_facet < 0).any():
        wrong = int((~right).sum())
        notes.append(
            Change(
                "bad_facets",
                f"{counted(wrong, 'facet')} without exactly three corners left out.",
                faces=wrong,
                lost=True,
            )
        )
        usable = of_facet >= 0
        usable[usable] = right[of_facet[usable]]
        points = points[usable]
    if not tokens.are(heads, b"endsolid").any():
        if len(heads) and not tokens.are(heads[-1:], b"endfacet")[0]:
            raise FileError(
                f"“{name}” is cut off: it ends in the middle of a triangle. "
                "Export the model again or get another copy of the file."
            )
        notes.append(
            Change(
                "no_end", "The text ends without “endsolid”: the file may be cut off.", lost=True
            )
        )
    return _welded(points, int(right.sum()), facets, notes)


def _unknown_lines(tokens: Tokens) -> list[Change]:
    """Return a note of the lines that begin with no word of the format, if there are any."""
    heads = tokens.first[:-1]
    unknown = ~np.any([tokens.are(heads, word) for word in _KNOWN], axis=0)
    if not unknown.any():
        return []
    first = int(tokens.line[np.argmax(unknown)]) + 1
    return [
        Change("unknown_lines", f"{counted(int(unknown.sum()), 'line')} of no known kind passed "
               f"over, the first at line {first:,}; what was meant there is not in the mesh.",
               lost=True)
    ]  # fmt: skip


def _welded(corners: F64, triangles: int, declared: int, notes: list[Change]) -> Soup:
    """Join equal corners, numbered by where each first appears."""
    if len(corners) == 0:
        return Soup(
            "STL", np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64), 0, 0, notes
        )
    place = places(corners)
    first = np.full(int(place.max()) + 1, len(corners))
    np.minimum.at(first, place, np.arange(len(corners)))
    order = np.argsort(first)
    rank: I64 = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return Soup(
        "STL",
        corners[first[order]],
        rank[place],
        np.full(triangles, 3, dtype=np.int64),
        len(corners),
        declared,
        notes,
    )
