"""OFF: counts, then vertices, then polygons, one a line."""

from __future__ import annotations

import re

import numpy as np

from engine.errors import FileError
from engine.files.report import counted
from engine.files.soup import INVALID, Soup
from engine.files.text import Tokens, decimals, plain_text, tokenise, wholes

# The prefixes come in any order in the wild; only a small n means “of n dimensions”.
_KEYWORD = re.compile(rb"((?:ST|C|N)*)(4?)(n?)OFF")


def scan_off(data: bytes, name: str) -> Soup:
    """Return what an OFF text holds (also COFF, NOFF, STOFF); colours and normals are passed by.

    Raises
    ------
    FileError
        The counts are missing, or they do not fit the lines that are there.
    """
    text, notes = plain_text(data)
    tokens = tokenise(text, comment=b"#")
    at = _keyword(tokens, name)
    if len(tokens.start) < at + 2:
        raise _damaged(name, "it does not say how many vertices and faces it has")
    counts, good = wholes(tokens, np.array([at, at + 1]))
    if not good.all() or (counts < 0).any():
        raise _damaged(name, "it does not say how many vertices and faces it has")
    n, f = (int(c) for c in counts)
    first = int(np.searchsorted(tokens.first, at, side="right"))
    lines = len(tokens.line) - first
    if lines != n + f:
        raise _damaged(
            name,
            f"it announces {counted(n, 'vertex')} and {counted(f, 'face')}, one a line, and has "
            f"{counted(lines, 'line')} of them",
        )
    vertex_lines, face_lines = np.arange(first, first + n), np.arange(first + n, first + n + f)
    widths = tokens.lengths[vertex_lines]
    # Where vertices have colours too: a face among them would be taken for one without.
    if n and (widths.min() < 3 or widths.min() != widths.max()):
        odd = vertex_lines[np.argmax(widths != widths[0])]
        raise _damaged(name, f"line {int(tokens.line[odd]) + 1:,} is not a vertex like the others")
    words = tokens.first[vertex_lines, None] + np.array([0, 1, 2])
    vertices = decimals(tokens, words.ravel()).reshape(-1, 3)
    sizes, sized = wholes(tokens, tokens.first[face_lines])
    sized &= (sizes >= 1) & (sizes < tokens.lengths[face_lines])
    if not sized.all():
        line = int(tokens.line[face_lines[np.argmin(sized)]]) + 1
        raise _damaged(name, f"line {line:,} is not a face: a count and as many vertex numbers")
    place = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    corners, whole = wholes(tokens, np.repeat(tokens.first[face_lines] + 1, sizes) + place)
    return Soup("OFF", vertices, np.where(whole, corners, INVALID), sizes, n, f, notes)


def _keyword(tokens: Tokens, name: str) -> int:
    """Return which word the counts begin at."""
    if len(tokens.start) == 0:
        raise _damaged(name, "it holds no words")
    word = tokens.text[tokens.start[0] : tokens.end[0]].tobytes()
    found = _KEYWORD.fullmatch(word.upper() if word.islower() and word != b"noff" else word)
    if found is None:
        return 0
    if found[2] or found[3]:
        raise FileError(
            f"“{name}” is an OFF file of another dimension than three. "
            "Export the model as a surface in three dimensions."
        )
    second = (
        tokens.text[tokens.start[1] : tokens.end[1]].tobytes() if len(tokens.start) > 1 else b""
    )
    if second.upper() == b"BINARY":
        raise FileError(
            f"“{name}” is a binary OFF file, which is not read. Save it as text OFF or as PLY."
        )
    return 1


def _damaged(name: str, fact: str) -> FileError:
    return FileError(
        f"“{name}” is damaged: {fact}. Export the model again or get another copy of the file."
    )
