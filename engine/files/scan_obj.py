"""OBJ: vertices and faces of a text that numbers everything from 1, or backwards from the end."""

from __future__ import annotations

import re

import numpy as np

from engine.arrays import B1, F64, I64
from engine.errors import FileError
from engine.files.report import Change, counted
from engine.files.soup import INVALID, Soup
from engine.files.text import Tokens, decimals, plain_text, spell_not_finite, tokenise, wholes

# x y z, with a weight, with a colour, with both, with a colour and its opacity.
_VERTEX_WIDTHS = (3, 4, 6, 7, 8)

# A line goes on only into numbers: a comment, a path or a name in another alphabet (whose second
# byte may be a backslash) ends in one too, and the vertex on the next line is not a part of it.
_CONTINUED = re.compile(rb"\\[ \t]*\n(?=[ \t]*(?:[-+.\d]|\\[ \t]*\n))")

_KNOWN = (
    b"vn vt vp g o s mtllib usemtl maplib usemap l p mg deg bmat step cstype curv curv2 surf "
    b"parm trim hole scrv sp end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech "
    b"call scmp csh"
).split()


def scan_obj(data: bytes, name: str) -> Soup:
    """Return what an OBJ text holds; colours, normals, textures and groups are passed by.

    Raises
    ------
    FileError
        A line that may have been a vertex cannot be read: all indices behind it would be shifted.
    """
    text, notes = plain_text(data)
    if b"\\" in text:
        text = _CONTINUED.sub(b" ", text)
    tokens = tokenise(text, comment=b"#")
    heads = tokens.first[:-1]
    is_vertex = tokens.are(heads, b"v")
    is_face = tokens.are(heads, b"f") | tokens.are(heads, b"fo")
    vertex_lines, face_lines = np.flatnonzero(is_vertex), np.flatnonzero(is_face)
    vertices = _vertices(tokens, vertex_lines, name, notes)
    unknown = _unknown_lines(tokens, np.flatnonzero(~is_vertex & ~is_face), notes)
    _refuse_lost_vertices(tokens, np.concatenate([unknown, face_lines]), name)
    corners, sizes = _faces(tokens, face_lines, vertex_lines)
    return Soup("OBJ", vertices, corners, sizes, len(vertex_lines), len(face_lines), notes)


def _vertices(tokens: Tokens, lines: I64, name: str, notes: list[Change]) -> F64:
    widths = tokens.lengths[lines] - 1
    enough = widths >= 3
    words = (tokens.first[lines[enough], None] + np.array([1, 2, 3])).ravel()
    values = decimals(tokens, words)
    if np.isnan(values).any():
        values = _with_points_for_commas(tokens, words, values, notes)
    vertices = np.full((len(lines), 3), np.nan)
    vertices[enough] = values.reshape(-1, 3)
    doubtful = enough & ~np.isin(widths, _VERTEX_WIDTHS)
    long = np.flatnonzero(enough & (widths > 4))
    if len(long):
        doubtful[long] |= _spoilt(tokens, lines[long], widths[long])
    if doubtful.any():
        raise _line_refused(tokens, int(lines[np.argmax(doubtful)]), name)
    return vertices


def _spoilt(tokens: Tokens, lines: I64, widths: I64) -> B1:
    """Return which long vertex lines have a word that is no number: two may have run together."""
    first = np.cumsum(widths) - widths
    place = np.arange(int(widths.sum())) - np.repeat(first, widths)
    words = np.repeat(tokens.first[lines] + 1, widths) + place
    bad = np.flatnonzero(np.isnan(decimals(tokens, words)))
    bad = bad[~spell_not_finite(tokens, words[bad])]
    spoilt = np.zeros(len(lines), dtype=bool)
    spoilt[np.searchsorted(first, bad, side="right") - 1] = True
    return spoilt


def _refuse_lost_vertices(tokens: Tokens, lines: I64, name: str) -> None:
    """Refuse lines that are no vertices but hold three decimals: a vertex whose "v" was damaged."""
    lines = lines[tokens.lengths[lines] >= 4]
    words = (tokens.first[lines, None] + np.array([1, 2, 3])).ravel()
    pointed = tokens.until(words, ord(".")) < tokens.end[words]
    held = pointed.reshape(-1, 3).any(axis=1)
    lines, words = lines[held], words.reshape(-1, 3)[held].ravel()
    vertices = np.isfinite(decimals(tokens, words).reshape(-1, 3)).all(axis=1)
    if vertices.any():
        raise _line_refused(tokens, int(lines[np.argmax(vertices)]), name)


def _line_refused(tokens: Tokens, line: int, name: str) -> FileError:
    return FileError(
        f"“{name}” is damaged: line {int(tokens.line[line]) + 1:,} should be a vertex and "
        "cannot be read, so that every index after it is in doubt. "
        "Export the model again or get another copy of the file."
    )


def _with_points_for_commas(tokens: Tokens, words: I64, values: F64, notes: list[Change]) -> F64:
    """Read 0,348 as 0.348 where the whole file is written so."""
    unread = np.flatnonzero(np.isnan(values))
    cut = tokens.until(words[unread], ord(","))
    comma = cut < tokens.end[words[unread]]
    if not comma.any() or (tokens.text[tokens.start[words[0]] : tokens.end[words[-1]]] == 46).any():
        return values
    text = tokens.text.copy()
    text[cut[comma]] = ord(".")
    pointed = Tokens(text, tokens.start, tokens.end, tokens.first, tokens.line)
    notes.append(Change("commas", "Decimal commas were read as decimal points."))
    return decimals(pointed, words)


def _faces(tokens: Tokens, lines: I64, vertex_lines: I64) -> tuple[I64, I64]:
    """Return corners (c,) from 0 and sizes (p,); a corner reads v, v/vt, v//vn or v/vt/vn."""
    sizes = tokens.lengths[lines] - 1
    starts = np.cumsum(sizes) - sizes
    place = np.arange(int(sizes.sum())) - np.repeat(starts, sizes)
    words = np.repeat(tokens.first[lines] + 1, sizes) + place
    numbers, good = wholes(tokens, words, tokens.until(words, ord("/")))
    before = np.repeat(np.searchsorted(vertex_lines, lines), sizes)
    corners = np.where(numbers > 0, numbers - 1, before + numbers)
    good &= numbers != 0
    return np.where(good, corners, INVALID), sizes


def _unknown_lines(tokens: Tokens, lines: I64, notes: list[Change]) -> I64:
    """Return which of `lines` begin with no word of the format, and note them."""
    surfaces = 0
    for word in _KNOWN:
        known = tokens.are(tokens.first[lines], word)
        surfaces += int(known.sum()) if word == b"surf" else 0
        lines = lines[~known]
    if len(lines):
        first = int(tokens.line[lines[0]]) + 1
        notes.append(
            Change("unknown_lines", f"{counted(len(lines), 'line')} of no known kind passed over, "
                   f"the first at line {first:,}; what was meant there is not in the mesh.",
                   lost=True)
        )  # fmt: skip
    if surfaces:
        notes.append(
            Change("free_form", f"{counted(surfaces, 'free-form surface')} left out: only polygons "
                   "are read.", lost=True)
        )  # fmt: skip
    return lines
