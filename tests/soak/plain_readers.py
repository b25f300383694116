"""Tiny readers that share nothing with the engine: a second opinion on what a file holds.

Each returns the vertices, (n, 3), and the polygons as tuples of vertex indices, leaving out
polygons that are too short, whose indices are out of range, or that touch a vertex that is not
finite. They go line by line and number by number, as plainly as the formats can be read.
"""

from __future__ import annotations

import math
import re
import struct
import zipfile
from io import BytesIO
from xml.dom import expatbuilder
from xml.dom.minidom import Element

Vertices = list[tuple[float, ...]]
Polygons = list[tuple[int, ...]]

PLAINLY_READ = ("OBJ", "OFF", "PLY", "STL", "3MF", "DAE", "X3D", "3DS")
NOWHERE = (math.nan, math.nan, math.nan)


def read_plainly(data: bytes, kind: str) -> tuple[Vertices, Polygons]:
    """Return what `data` holds, read as the format `kind`."""
    readers = {
        "OBJ": _obj, "OFF": _off, "PLY": _ply, "STL": _stl, "3MF": _3mf, "DAE": _dae, "X3D": _x3d,
        "3DS": _3ds,
    }  # fmt: skip
    vertices, polygons = readers[kind](data)
    return vertices, [p for p in polygons if _is_usable(p, vertices)]


def triangles_of(vertices: Vertices, polygons: Polygons) -> tuple[set[tuple[float, ...]], int]:
    """Return the corners of the three-cornered polygons, and how many triangles all make."""
    corners = {tuple(c + 0.0 for i in p for c in vertices[i]) for p in polygons if len(p) == 3}
    return corners, sum(len(p) - 2 for p in polygons)


def _is_usable(polygon: tuple[int, ...], vertices: Vertices) -> bool:
    if len(polygon) < 3 or min(polygon) < 0 or max(polygon) >= len(vertices):
        return False
    return all(math.isfinite(c) for i in polygon for c in vertices[i])


def _number(word: str) -> float:
    # Python takes more than the formats have: underscores, full-width digits.
    plain = word.isascii() and "_" not in word
    try:
        return float(word) if plain else math.nan
    except ValueError:
        return math.nan


def _index(word: str) -> int | None:
    sign, digits = (word[:1], word[1:]) if word[:1] in ("-", "+") else ("", word)
    if not (digits.isascii() and digits.isdigit()) or len(digits) > 15:
        return None
    return -int(digits) if sign == "-" else int(digits)


def _words(line: str) -> list[str]:
    return [
        w for w in line.replace("\v", " ").replace("\f", " ").replace("\t", " ").split(" ") if w
    ]


def _lines(data: bytes, comment: str = "") -> list[list[str]]:
    text = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    return [_words(line.split(comment)[0] if comment else line) for line in lines]


def _place(words: list[str]) -> tuple[float, ...]:
    return tuple(_number(w) for w in words[:3]) if len(words) >= 3 else NOWHERE


def _continued(data: bytes) -> bytes:
    """Return an OBJ text with lines joined where a backslash goes on into numbers."""
    joined: list[bytes] = []
    goes_on = False
    for line in data.split(b"\n"):
        start = line.lstrip(b" \t")
        number = start[:1] in (b"-", b"+", b".") or start[:1].isdigit()
        bare = start.rstrip(b" \t") == b"\\"
        if goes_on and (number or bare):
            joined[-1] = joined[-1].rstrip(b" \t")[:-1] + b" " + line
        else:
            joined.append(line)
        goes_on = joined[-1].rstrip(b" \t").endswith(b"\\")
    return b"\n".join(joined)


def _obj(data: bytes) -> tuple[Vertices, Polygons]:
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    data = _continued(data)
    vertices: Vertices = []
    polygons: Polygons = []
    for words in _lines(data, "#"):
        if words and words[0].lower() == "v":
            vertices.append(_place(words[1:]))
        elif words and words[0].lower() in ("f", "fo"):
            indices = [_index(w.split("/")[0]) for w in words[1:]]
            # A zero and a word that is no number name no vertex.
            polygons.append(
                tuple(
                    1 << 40 if i is None or i == 0 else i - 1 if i > 0 else len(vertices) + i
                    for i in indices
                )
            )
    # A later vertex does not make an index valid that counted back too far.
    return vertices, polygons


def _off(data: bytes) -> tuple[Vertices, Polygons]:
    lines = [words for words in _lines(data, "#") if words]
    words = [w for line in lines for w in line]
    at = 1 if words[0].upper().endswith("OFF") else 0
    n, f = int(words[at]), int(words[at + 1])
    seen = 0
    while seen <= at:
        seen += len(lines.pop(0))
    vertices = [_place(line) for line in lines[:n]]
    polygons: Polygons = []
    for line in lines[n : n + f]:
        size = _index(line[0]) or 0
        indices = [_index(w) for w in line[1 : 1 + size]]
        polygons.append(tuple(1 << 40 if i is None else i for i in indices))
    return vertices, polygons


_CODES = {
    "char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h",
    "ushort": "H", "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I",
    "float": "f", "float32": "f", "double": "d", "float64": "d",
}  # fmt: skip


def _ply(data: bytes) -> tuple[Vertices, Polygons]:
    end = data.index(b"end_header") + len(b"end_header")
    head = data[:end].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    body = data[end + (2 if data[end : end + 2] == b"\r\n" else 1) :]
    order, elements = "", []
    for words in (line.split() for line in head.split("\n")):
        if words[:1] == ["format"]:
            order = {"binary_little_endian": "<", "binary_big_endian": ">"}.get(words[1], "")
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    take = _binary_taker(body, order) if order else _text_taker(body)
    rows = {name: [_ply_row(properties, take) for _ in range(count)]
            for name, count, properties in elements}  # fmt: skip
    vertices = [tuple(float(row[axis]) for axis in "xyz") for row in rows["vertex"]]
    polygons = [
        tuple(
            int(i) if math.isfinite(i) and i == int(i) else 1 << 40
            for i in row.get("vertex_indices", row.get("vertex_index", ()))
        )
        for row in rows["face"]
    ]
    return vertices, polygons


def _ply_row(properties: list[list[str]], take):
    row = {}
    for words in properties:
        if words[0] == "list":
            length = int(take(words[1]))
            row[words[3]] = [take(words[2]) for _ in range(length)]
        else:
            row[words[1]] = take(words[0])
    return row


def _binary_taker(body: bytes, order: str):
    at = 0

    def take(kind: str) -> float:
        nonlocal at
        code = order + _CODES[kind]
        (value,) = struct.unpack_from(code, body, at)
        at += struct.calcsize(code)
        return value

    return take


def _text_taker(body: bytes):
    words = iter([w for line in _lines(body) for w in line])
    return lambda kind: _number(next(words))


def _stl(data: bytes) -> tuple[Vertices, Polygons]:
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count or b"facet" not in data[:2048].lower():
        count = (len(data) - 84) // 50
        numbers = [struct.unpack_from("<12f", data, 84 + 50 * i) for i in range(count)]
        corners = [n[3 + 3 * j : 6 + 3 * j] for n in numbers for j in range(3)]
        return corners, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(count)]
    facets: list[list[tuple[float, ...]]] = []
    for words in _lines(data):
        if words and words[0].lower() == "facet":
            facets.append([])
        elif words and words[0].lower() == "vertex" and facets:
            facets[-1].append(_place(words[1:]) if len(words) == 4 else NOWHERE)
    facets = [facet for facet in facets if len(facet) == 3]
    corners = [corner for facet in facets for corner in facet]
    return corners, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(len(facets))]


def _3mf(data: bytes) -> tuple[Vertices, Polygons]:
    with zipfile.ZipFile(BytesIO(data)) as archive:
        (part,) = [n for n in archive.namelist() if n.endswith(".model")]
        elements = _elements(archive.read(part))
    tags = [(_tag(e), dict(e.attributes.items())) for e in elements]
    vertices = [tuple(_number(a.get(k, "")) for k in "xyz") for tag, a in tags if tag == "vertex"]
    polygons = []
    for tag, a in tags:
        if tag == "triangle":
            values = [_number(a.get(k, "")) for k in ("v1", "v2", "v3")]
            whole = [math.isfinite(v) and v == int(v) for v in values]
            polygons.append(
                tuple(int(v) if w else 1 << 40 for v, w in zip(values, whole, strict=True))
            )
    return vertices, polygons


def _elements(data: bytes) -> list[Element]:
    document = expatbuilder.parseString(data, namespaces=False)
    return list(document.getElementsByTagName("*"))


def _tag(element: Element) -> str:
    return str(element.nodeName).rpartition(":")[2]


def _text(element: Element) -> str:
    return "".join(c.data for c in element.childNodes if c.nodeType in (c.TEXT_NODE, 4))


def _inside(element: Element, tag: str) -> list[Element]:
    return [c for c in element.childNodes if c.nodeType == c.ELEMENT_NODE and _tag(c) == tag]


def _split(text: str) -> list[str]:
    return [w for w in re.split(r"[ \t\n\v\f]+", text) if w]


def _dae(data: bytes) -> tuple[Vertices, Polygons]:
    """Geometries of triangles that are placed, unmoved, with three numbers for each vertex."""
    every = _elements(data)
    known: dict[str, Element] = {}
    for e in every:
        if e.hasAttribute("id"):
            known.setdefault(e.getAttribute("id"), e)
    vertices: Vertices = []
    polygons: Polygons = []
    for instance in [e for e in every if _tag(e) == "instance_geometry"]:
        for mesh in _inside(known[instance.getAttribute("url")[1:]], "mesh"):
            for triangles in _inside(mesh, "triangles"):
                places, corners = _dae_triangles(triangles, known)
                first = len(vertices)
                vertices += places
                inside = [c + first if 0 <= c < len(places) else 1 << 40 for c in corners]
                polygons += [tuple(inside[i : i + 3]) for i in range(0, len(inside), 3)]
    return vertices, polygons


def _dae_triangles(triangles: Element, known: dict[str, Element]) -> tuple[Vertices, list[int]]:
    inputs = _inside(triangles, "input")
    stride = 1 + max(int(e.getAttribute("offset") or 0) for e in inputs)
    (vertex,) = [e for e in inputs if e.getAttribute("semantic") == "VERTEX"]
    joined = known[vertex.getAttribute("source")[1:]]
    position = next(e for e in _inside(joined, "input") if e.getAttribute("semantic") == "POSITION")
    source = known[position.getAttribute("source")[1:]]
    accessor = _inside(_inside(source, "technique_common")[0], "accessor")[0]
    words = _split(_text(known[accessor.getAttribute("source")[1:]]))
    step, skip = (
        int(accessor.getAttribute("stride") or 1),
        int(accessor.getAttribute("offset") or 0),
    )
    named = [bool(e.getAttribute("name")) for e in _inside(accessor, "param")]
    used = [i for i, yes in enumerate(named) if yes or not any(named)] or [0, 1, 2]
    places = []
    for row in range(int(accessor.getAttribute("count"))):
        places.append(tuple(_number(words[skip + row * step + i]) for i in used[:3]))
    listed = [w for p in _inside(triangles, "p") for w in _split(_text(p))]
    corners = [_index(w) for w in listed[int(vertex.getAttribute("offset") or 0) :: stride]]
    return places, [1 << 40 if c is None else c for c in corners]


def _x3d(data: bytes) -> tuple[Vertices, Polygons]:
    """Sets of faces in shapes, each with coordinates of its own, not moved."""
    vertices: Vertices = []
    polygons: Polygons = []
    shapes = [e for e in _elements(data) if _tag(e) == "Shape"]
    for faces in [f for e in shapes for f in _inside(e, "IndexedFaceSet")]:
        words = _split(_inside(faces, "Coordinate")[0].getAttribute("point").replace(",", " "))
        numbers = [_number(w) for w in words]
        count, first = len(numbers) // 3, len(vertices)
        vertices += [tuple(numbers[3 * i : 3 * i + 3]) for i in range(count)]
        found: list[list[int]] = [[]]
        for word in _split(faces.getAttribute("coordIndex").replace(",", " ")):
            index = _index(word)
            if index == -1:
                found.append([])
            else:
                inside = index is not None and 0 <= index < count
                found[-1].append(first + index if inside and index is not None else 1 << 40)
        around = -1 if faces.getAttribute("ccw").strip().lower() == "false" else 1
        polygons += [tuple(p[::around]) for p in found]
    return vertices, polygons


def _3ds(data: bytes) -> tuple[Vertices, Polygons]:
    vertices: Vertices = []
    polygons: Polygons = []

    def read(at: int, end: int, first: int) -> None:
        while at + 6 <= end:
            kind, length = struct.unpack_from("<HI", data, at)
            inside = at + 6
            if kind == 0x4000:
                inside = data.index(b"\0", inside) + 1
            if kind == 0x4100:
                first = len(vertices)
            if kind in (0x4D4D, 0x3D3D, 0x4000, 0x4100):
                read(inside, at + length, first)
            elif kind == 0x4110:
                (count,) = struct.unpack_from("<H", data, inside)
                vertices.extend(
                    struct.unpack_from("<3f", data, inside + 2 + 12 * i) for i in range(count)
                )
            elif kind == 0x4120:
                (count,) = struct.unpack_from("<H", data, inside)
                rows = [struct.unpack_from("<3H", data, inside + 2 + 8 * i) for i in range(count)]
                polygons.extend((a + first, b + first, c + first) for a, b, c in rows)
            at += length

    read(0, len(data), 0)
    return vertices, polygons
