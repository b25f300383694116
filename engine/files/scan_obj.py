"""OBJ: vertices and faces of a text that numbers everything from 1, or backwards from the end."""

from __future__ import annotations

import re

import numpy as np

from engine.arrays import B1, F64, I64
from engine.files.report import Change, counted
from engine.files.soup import INVALID, Soup
from engine.files.text import Tokens, decimals, plain_text, tokenise, wholes


def scan_obj(data: bytes) -> Soup:
    """Return what an OBJ text holds; colours, normals, texture coordinates and groups are passed by."""
    text, notes = plain_text(data)
    if b"\\" in text:
        # Only the text's own words are joined: a path in a mtllib line may end in a backslash too.
        text = re.sub(rb"\\[ \t]*\n", b" ", text)
    tokens = tokenise(text, comment=b"#")
    heads = tokens.first[:-1]
    vertex_lines = np.flatnonzero(tokens.are(heads, b"v"))
    face_lines = np.flatnonzero(tokens.are(heads, b"f") | tokens.are(heads, b"fo"))
    vertices = _vertices(tokens, vertex_lines, notes)
    corners, sizes = _faces(tokens, face_lines, vertex_lines)
    _note_unread(tokens, heads, notes)
    return Soup("OBJ", vertices, corners, sizes, len(vertex_lines), len(face_lines), notes)


def _vertices(tokens: Tokens, lines: I64, notes: list[Change]) -> F64:
    enough = tokens.lengths[lines] >= 4
    words = tokens.first[lines[enough], None] + np.array([1, 2, 3])
    vertices = np.full((len(lines), 3), np.nan)
    values = decimals(tokens, words.ravel())
    if np.isnan(values).any():
        values = _with_points_for_commas(tokens, words.ravel(), values, notes)
    vertices[enough] = values.reshape(-1, 3)
    return vertices


def _with_points_for_commas(
    tokens: Tokens, words: I64, values: F64, notes: list[Change]
) -> F64:
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


_KNOWN = (
    b"v vt vn vp f fo g o s mtllib usemtl maplib usemap l p mg deg bmat step cstype curv curv2 surf "
    b"parm trim hole scrv sp end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech "
    b"call scmp csh"
).split()


def _note_unread(tokens: Tokens, heads: I64, notes: list[Change]) -> None:
    known: B1 = np.zeros(len(heads), dtype=bool)
    for word in _KNOWN:
        known |= tokens.are(heads, word)
    unread = int((~known).sum())
    if unread:
        line = int(tokens.line[np.flatnonzero(~known)[0]]) + 1
        notes.append(
            Change(
                "unknown_lines",
                f"{counted(unread, 'line')} of no known kind passed over, the first at line "
                f"{line:,}. What was meant there is not in the mesh.",
                lost=True,
            )
        )
    surfaces = int(tokens.are(heads, b"surf").sum())
    if surfaces:
        notes.append(
            Change("free_form", f"{counted(surfaces, 'free-form surface')} left out: only polygons "
                   "are read.", lost=True)
        )
