"""PLY, binary and text: a header that promises, and a body that is checked against it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.report import Change, counted, shown
from engine.files.soup import INVALID, Soup
from engine.files.text import UTF8_MARK, decimals, plain_text, tokenise

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_BODIES = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_HEADER_LIMIT = 1 << 24
# The word may stand in a comment too.
_HEADER_END = re.compile(rb"(?<=[\r\n])end_header[ \t]*")


@dataclass(frozen=True)
class Property:
    """One property: its name, its number type, and the type of its length where it is a list."""

    name: str
    type: str
    length_type: str = ""


@dataclass(frozen=True)
class Element:
    """One element of the header: its name, how many rows it has, and its properties."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def shown(self) -> str:
        """The name as it can be printed in a sentence."""
        return shown(self.name[:60])

    def column(self, name: str) -> int:
        """Return which property is called `name`, or -1."""
        names = [p.name for p in self.properties]
        return names.index(name) if name in names else -1


class StripsError(Exception):
    """The file's faces are triangle strips, which this scanner does not read."""


def scan_ply(data: bytes, name: str) -> Soup:
    """Return what a PLY holds; properties other than positions and faces are passed by.

    Raises
    ------
    FileError
        The header is damaged, or it promises more or less than the bytes hold.
    StripsError
        The faces are triangle strips.
    """
    # The bytes of a binary body stay as they are: one that reads as a line end is none.
    data = data.removeprefix(UTF8_MARK).lstrip()
    if data[:3].lower() != b"ply":
        data = plain_text(data)[0]
    elements, order, body = _header(data, name)
    vertex, face = _known(elements, name)
    table: _BinaryBody | _TextBody
    if order:
        table = _BinaryBody(data, body, order, name)
    else:
        table = _TextBody(data[body:], elements, name)
    vertices: F64 = np.empty((0, 3))
    corners, sizes = np.empty(0, np.int64), np.empty(0, np.int64)
    for element in elements:
        if element is vertex:
            columns = [element.column(axis) for axis in "xyz"]
            vertices = table.rows(element, columns)
        elif element is face:
            corners, sizes = table.lists(element, _index_column(element))
        else:
            table.skip(element)
    notes = table.finish()
    return Soup("PLY", vertices, corners, sizes, vertex.count, face.count, notes)


def _index_column(face: Element) -> int:
    return max(face.column("vertex_indices"), face.column("vertex_index"))


def _known(elements: list[Element], name: str) -> tuple[Element, Element]:
    by_name = {e.name: e for e in elements}
    vertex, face = by_name.get("vertex"), by_name.get("face")
    if face is None and ("tristrips" in by_name):
        raise StripsError
    if vertex is None or min(vertex.column(axis) for axis in "xyz") < 0:
        raise _damaged(name, "its header announces no vertices with x, y and z")
    if any(p.length_type for p in vertex.properties):
        raise StripsError
    if (
        face is None
        or _index_column(face) < 0
        or not face.properties[_index_column(face)].length_type
    ):
        raise FileError(
            f"“{name}” holds no faces, so there is no surface to open. "
            "Export the model again as a triangle mesh."
        )
    if face.properties[_index_column(face)].type[0] == "f":
        raise _damaged(name, "its face indices are not whole numbers")
    return vertex, face


def _damaged(name: str, fact: str) -> FileError:
    return FileError(
        f"“{name}” is damaged: {fact}. Export the model again or get another copy of the file."
    )


def _header(data: bytes, name: str) -> tuple[list[Element], str, int]:
    """Return the elements, the byte order ("" for text) and where the body begins."""
    head = data[:_HEADER_LIMIT]
    end = _HEADER_END.search(head)
    if end is None:
        raise _damaged(name, "its header does not end")
    body = end.end()
    # Line ends are those of the program that wrote it: LF, CRLF or CR. Where they are CR, an LF
    # behind the last one is the body's first byte.
    body += 2 if data[body : body + 2] == b"\r\n" and b"\n" in head[: end.start()] else 1
    text = head[: end.start()].decode("latin-1").replace("\r", "\n")
    lines = [line.split() for line in text.split("\n")]
    order: str | None = None
    elements: list[Element] = []
    for words in lines[1:]:
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) >= 2 and words[1] in _BODIES:
            order = _BODIES[words[1]]
        elif (
            words[0] == "element" and len(words) == 3 and words[2].isascii() and words[2].isdigit()
        ):
            if words[1] in [e.name for e in elements]:
                raise _damaged(name, f"its header announces “{shown(words[1][:60])}” twice")
            elements.append(Element(words[1], int(words[2][:30]), ()))
        elif words[0] == "property" and elements and (made := _property(words)):
            last = elements[-1]
            elements[-1] = Element(last.name, last.count, (*last.properties, made))
        else:
            raise _damaged(name, f"its header has the line “{shown(' '.join(words)[:60])}”")
    if order is None:
        raise _damaged(name, "its header does not say whether the body is text or binary")
    return elements, order, body


def _property(words: list[str]) -> Property | None:
    if len(words) == 3 and words[1] in _TYPES:
        return Property(words[2], _TYPES[words[1]])
    listed = len(words) == 5 and words[1] == "list"
    if listed and words[2] in _TYPES and words[3] in _TYPES and _TYPES[words[2]][0] != "f":
        return Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    return None


class _BinaryBody:
    """Reads the elements of a binary body one after the other; never beyond the bytes there."""

    def __init__(self, data: bytes, position: int, order: str, name: str) -> None:
        self._data = data
        self._at = position
        self._order = order
        self._name = name

    def rows(self, element: Element, columns: list[int]) -> F64:
        """Return the columns of an element without lists as (count, len(columns)) float64."""
        table = self._fixed(element)
        return np.column_stack([table[f"p{c}"] for c in columns]).astype(np.float64)

    def skip(self, element: Element) -> None:
        """Pass over an element."""
        if any(p.length_type for p in element.properties):
            self.lists(element, -1)
        else:
            self._fixed(element)

    def _fixed(self, element: Element) -> NDArray[np.void]:
        row = np.dtype([(f"p{i}", self._order + p.type) for i, p in enumerate(element.properties)])
        if element.count * row.itemsize > len(self._data) - self._at:
            raise self._early(element)
        if row.itemsize == 0:
            return np.empty(0, row)
        table = np.frombuffer(self._data, row, count=element.count, offset=self._at)
        self._at += element.count * row.itemsize
        return table

    def lists(self, element: Element, column: int) -> tuple[I64, I64]:
        """Return the lists in `column` (corners, sizes), runs of equally long rows at once."""
        corners: list[I64] = []
        sizes: list[I64] = []
        if not any(p.length_type for p in element.properties):
            raise _damaged(self._name, f"the element “{element.shown}” has no list")
        done = 0
        ahead = 64
        while done < element.count:
            row = self._row_like_next(element)
            there = (len(self._data) - self._at) // row.itemsize
            many = min(element.count - done, there, ahead)
            if many == 0:
                raise self._early(element)
            table = np.frombuffer(self._data, row, count=many, offset=self._at)
            alike = self._alike(table, element)
            if column >= 0:
                listed = table[f"p{column}"][:alike]
                corners.append(listed.reshape(-1).astype(np.int64))
                sizes.append(np.full(alike, listed.shape[1], dtype=np.int64))
            self._at += alike * row.itemsize
            done += alike
            # Look further ahead where rows go on alike; triangles and quads in turns stay short.
            ahead = min(ahead * 16, 1 << 24) if alike == many else 64
        empty = np.empty(0, np.int64)
        return np.concatenate([empty, *corners]), np.concatenate([empty, *sizes])

    def _row_like_next(self, element: Element) -> np.dtype[np.void]:
        """Return the layout of the next row, with its lists as long as they are there."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        at = self._at
        for i, p in enumerate(element.properties):
            if p.length_type:
                kind = np.dtype(self._order + p.length_type)
                if at + kind.itemsize > len(self._data):
                    raise self._early(element)
                length = int(np.frombuffer(self._data, kind, 1, at)[0])
                if length < 0 or length * np.dtype(p.type).itemsize > len(self._data) - at:
                    raise self._early(element)
                fields.append((f"n{i}", self._order + p.length_type))
                fields.append((f"p{i}", self._order + p.type, (length,)))
                at += kind.itemsize + length * np.dtype(p.type).itemsize
            else:
                fields.append((f"p{i}", self._order + p.type))
                at += np.dtype(p.type).itemsize
        return np.dtype(fields)

    @staticmethod
    def _alike(table: NDArray[np.void], element: Element) -> int:
        """Return how many rows from the start have lists as long as the first row's."""
        other = np.zeros(len(table), dtype=bool)
        for i, p in enumerate(element.properties):
            if p.length_type:
                other |= table[f"n{i}"] != table[f"n{i}"][0]
        return int(np.argmax(other)) if other.any() else len(table)

    def finish(self) -> list[Change]:
        """Check that nothing is left over."""
        rest = self._data[self._at :]
        if rest.strip(b"\0\r\n\t "):
            raise _damaged(
                self._name,
                f"{counted(len(rest), 'byte')} are left over behind what its header announces",
            )
        return []

    def _early(self, element: Element) -> FileError:
        return _damaged(
            self._name,
            f"its header announces {element.count:,} of “{element.shown}”, and the file ends "
            "before",
        )


class _TextBody:
    """Reads the elements of a text body: one row a line."""

    def __init__(self, data: bytes, elements: list[Element], name: str) -> None:
        self._tokens = tokenise(plain_text(data)[0])
        self._line = 0
        self._name = name

    def _take(self, element: Element) -> I64:
        lines = len(self._tokens.line)
        if self._line + element.count > lines:
            raise _damaged(
                self._name,
                f"its header announces {element.count:,} of “{element.shown}”, and the file ends "
                "before",
            )
        taken = np.arange(self._line, self._line + element.count)
        self._line += element.count
        return taken

    def rows(self, element: Element, columns: list[int]) -> F64:
        """Return the columns of an element without lists as (count, len(columns)) float64."""
        lines = self._take(element)
        self._require(lines, self._tokens.lengths[lines] == len(element.properties))
        words = self._tokens.first[lines, None] + np.array(columns)
        return decimals(self._tokens, words.ravel()).reshape(-1, len(columns))

    def skip(self, element: Element) -> None:
        """Pass over an element."""
        self._take(element)

    def lists(self, element: Element, column: int) -> tuple[I64, I64]:
        """Return the lists in `column` (corners, sizes)."""
        lines = self._take(element)
        tokens = self._tokens
        cursor = tokens.first[lines]
        last = tokens.first[lines + 1]
        corners, sizes = np.empty(0, np.int64), np.empty(0, np.int64)
        for i, p in enumerate(element.properties):
            if not p.length_type:
                cursor = cursor + 1
                continue
            self._require(lines, cursor < last)
            lengths = decimals(tokens, cursor)
            self._require(lines, (lengths >= 0) & (lengths == np.floor(lengths)) & (lengths < 1e9))
            longs = lengths.astype(np.int64)
            self._require(lines, cursor + 1 + longs <= last)
            if i == column:
                sizes = longs
                first = np.cumsum(sizes) - sizes
                place = np.arange(int(sizes.sum())) - np.repeat(first, sizes)
                values = decimals(tokens, np.repeat(cursor + 1, sizes) + place)
                whole = (values == np.floor(values)) & (np.abs(values) < 2.0**53)
                corners = np.where(whole, values, float(INVALID)).astype(np.int64)
            cursor = cursor + 1 + longs
        self._require(lines, cursor == last)
        return corners, sizes

    def finish(self) -> list[Change]:
        """Check that nothing is left over."""
        rest = len(self._tokens.line) - self._line
        if rest:
            raise _damaged(
                self._name,
                f"{counted(rest, 'line')} are left over behind what its header announces",
            )
        return []

    def _require(self, lines: I64, right: NDArray[np.bool_]) -> None:
        if not right.all():
            line = int(self._tokens.line[lines[np.argmin(right)]]) + 1
            raise _damaged(
                self._name, f"line {line:,} behind the header does not hold what it announces"
            )
