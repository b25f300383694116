"""DAE (COLLADA): geometries of sources and primitives, placed by the nodes of a scene."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.gathered import Gathered, Piece, joined
from engine.files.markup import Element, indices, numbers, read_tree
from engine.files.report import Change, counted, shown
from engine.files.soup import INVALID, Soup, damaged

_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_NO_SURFACE = ("lines", "linestrips", "spline", "brep")
_DEPTH = 100


@dataclass
class _File:
    name: str
    root: Element
    known: dict[str, Element] = field(default_factory=dict)
    made: dict[int, Piece] = field(default_factory=dict)
    tables: dict[int, F64] = field(default_factory=dict)
    positions: dict[int, F64] = field(default_factory=dict)
    skinned: int = 0

    def find(self, reference: str, *tags: str) -> Element:
        """Return the element that “#id” refers to, which must be one of `tags`."""
        found = self.known.get(reference.removeprefix("#"))
        if found is None or not reference.startswith("#") or found.tag not in tags:
            raise damaged(
                self.name, f"it refers to “{shown(reference[:60])}”, which is no {tags[0]} in it"
            )
        return found


def scan_dae(data: bytes, name: str) -> Soup:
    """Return what the scene of a COLLADA file places; all its geometries where it has no scene.

    Skins are shown as they were bound, coordinates keep the file's unit and axes.

    Raises
    ------
    FileError
        It is no XML, a count is not what is there, or a reference leads nowhere or in a circle.
    """
    file = _File(name, read_tree(data, name))
    for element in file.root.walk():
        if "id" in element.attributes:
            file.known.setdefault(element.attributes["id"], element)
    geometries = [g for g in file.root.walk() if g.tag == "geometry"]
    gathered = Gathered(name)
    scene = file.root.first("scene")
    instance = scene.first("instance_visual_scene") if scene else None
    if instance is not None:
        world = file.find(instance.get("url"), "visual_scene")
        _place_nodes(file, gathered, world.all("node"))
    else:
        for geometry in geometries:
            gathered.place(_geometry(file, geometry), np.eye(4))
    return gathered.soup("DAE", _notes(file, geometries))


def _notes(file: _File, geometries: list[Element]) -> list[Change]:
    notes = []
    unused = [g for g in geometries if id(g) not in file.made]
    if unused:
        left = [_geometry(file, g) for g in unused]
        notes.append(
            Change(
                "not_placed",
                f"{counted(len(unused), 'object')} that the file does not place left out.",
                sum(len(p.vertices) for p in left),
                sum(len(p.sizes) for p in left),
                lost=True,
            )
        )
    beside = sum(len(mesh.all(*_NO_SURFACE)) for g in geometries for mesh in (g, *g.children))
    if beside:
        notes.append(Change("no_surface", f"{counted(beside, 'set')} of curves left out."))
    if file.skinned:
        notes.append(
            Change("skin", "The model has a skeleton; it is shown in the pose it was bound in.")
        )
    unit = next((e.get("name") for e in file.root.walk() if e.tag == "unit"), "")
    if unit:
        unit = shown(unit[:60])
        notes.append(
            Change("unit", f"The file's unit is {unit}; the numbers were kept as they are.")
        )
    return notes


def _place_nodes(file: _File, gathered: Gathered, nodes: list[Element]) -> None:
    """Place all that the nodes of a scene hold, down to the last child."""
    waiting = [(node, np.eye(4), 1) for node in reversed(nodes)]
    while waiting:
        node, outer, depth = waiting.pop()
        gathered.visit()
        if depth > _DEPTH:
            raise damaged(file.name, f"its nodes are held in each other more than {_DEPTH} deep")
        with np.errstate(all="ignore"):
            matrix = outer @ _transform(file, node)
        for instance in node.all("instance_geometry"):
            gathered.place(_geometry(file, file.find(instance.get("url"), "geometry")), matrix)
        for instance in node.all("instance_controller"):
            _place_controller(file, gathered, instance.get("url"), matrix)
        inner = node.all("node")
        inner += [file.find(i.get("url"), "node") for i in node.all("instance_node")]
        waiting.extend((child, matrix, depth + 1) for child in reversed(inner))


def _place_controller(file: _File, gathered: Gathered, url: str, matrix: F64) -> None:
    """Place the geometry of a skin as it was bound, or of a morph as it is without weights."""
    for _ in range(_DEPTH):
        controller = file.find(url, "controller")
        what = controller.first("skin", "morph")
        if what is None:
            raise damaged(file.name, "a controller in it controls nothing")
        url = what.get("source")
        if what.tag == "skin":
            file.skinned += 1
            shape = what.first("bind_shape_matrix")
            # Its joints, not its node, say where a skin is; bound, they leave it where it was.
            matrix = np.eye(4) if shape is None else _numbers(file, shape, 16).reshape(4, 4)
        if file.known.get(url.removeprefix("#"), controller).tag != "controller":
            gathered.place(_geometry(file, file.find(url, "geometry")), matrix)
            return
    raise damaged(file.name, "a controller in it controls itself")


def _transform(file: _File, node: Element) -> F64:
    """Return the product (4, 4) of a node's transforms, in the order in which they are written."""
    whole = np.eye(4)
    for element in node.children:
        step = np.eye(4)
        if element.tag == "matrix":
            step = _numbers(file, element, 16).reshape(4, 4)
        elif element.tag == "translate":
            step[:3, 3] = _numbers(file, element, 3)
        elif element.tag == "scale":
            step[:3, :3] = np.diag(_numbers(file, element, 3))
        elif element.tag == "rotate":
            x, y, z, degrees = _numbers(file, element, 4)
            step[:3, :3] = rotation(np.array([x, y, z]), float(np.radians(degrees)))
        elif element.tag in ("lookat", "skew"):
            raise _unread(file, f"moves a part by “{element.tag}”")
        with np.errstate(all="ignore"):
            whole = whole @ step
    return whole


def rotation(axis: F64, angle: float) -> F64:
    """Return the matrix (3, 3) that turns by `angle` radians around `axis`; none for no axis."""
    length = float(np.linalg.norm(axis))
    if length == 0 or not np.isfinite(length):
        return np.eye(3)
    x, y, z = axis / length
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across)


def _numbers(file: _File, element: Element, count: int) -> F64:
    found = numbers(element.text)
    if len(found) != count or not np.isfinite(found).all():
        raise damaged(file.name, f"a “{element.tag}” in it is not {count} numbers")
    return found


def _geometry(file: _File, geometry: Element) -> Piece:
    """Return all polygons of a geometry; those of several materials share their vertices."""
    if id(geometry) not in file.made:
        meshes = geometry.all("mesh", "convex_mesh")
        parts = [part for mesh in meshes for part in mesh.all(*_PRIMITIVES)]
        file.made[id(geometry)] = joined([_primitive(file, part) for part in parts])
    return file.made[id(geometry)]


def _primitive(file: _File, primitive: Element) -> Piece:
    inputs = primitive.all("input")
    offsets = [_whole(file, i.get("offset", "0"), "an offset") for i in inputs]
    stride = max(offsets, default=0) + 1
    vertex = [
        (i, at) for i, at in zip(inputs, offsets, strict=True) if i.get("semantic") == "VERTEX"
    ]
    if len(vertex) != 1:
        raise damaged(file.name, "a set of faces in it does not say which vertices it joins")
    source, at = vertex[0]
    for other in inputs:
        if other is not source:
            _table(file, other.get("source"))
    table = _positions(file, source.get("source"))
    count = _whole(file, primitive.get("count"), "a number of faces")
    rows = [_rows(file, p, stride)[:, at] for p in primitive.all("p")]
    if primitive.all("ph"):
        raise _unread(file, "has polygons with holes")
    corners, sizes = _corners(file, primitive, rows, count)
    return Piece(table, corners, sizes)


def _corners(file: _File, primitive: Element, rows: list[I64], count: int) -> tuple[I64, I64]:
    """Return the corners of all polygons and their numbers, as the kind of primitive has them."""
    listed = np.concatenate([np.empty(0, np.int64), *rows])
    if primitive.tag in ("polygons", "tristrips", "trifans"):
        if len(rows) != count:
            raise _miscounted(file, primitive, count, len(rows))
        if primitive.tag == "polygons":
            return listed, np.array([len(row) for row in rows], dtype=np.int64)
        pieces = [strip(row) if primitive.tag == "tristrips" else fan(row) for row in rows]
        triangles = np.concatenate([np.empty((0, 3), np.int64), *pieces])
        return triangles.ravel(), np.full(len(triangles), 3)
    if primitive.tag == "triangles":
        if len(listed) != 3 * count:
            raise _miscounted(file, primitive, count, len(listed) // 3)
        return listed, np.full(count, 3)
    written = primitive.first("vcount")
    sizes = indices(written.text if written else "", -1)
    if len(sizes) != count:
        raise _miscounted(file, primitive, count, len(sizes))
    if (sizes < 0).any() or int(sizes.sum()) != len(listed):
        raise damaged(file.name, "the corners of its polygons are not as many as they announce")
    return listed, sizes


def strip(row: I64) -> I64:
    """Return the triangles (t, 3) of a strip of vertices, every other one turned."""
    triangles = np.column_stack([row[:-2], row[1:-1], row[2:]])
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles


def fan(row: I64) -> I64:
    """Return the triangles (t, 3) of a fan of vertices around its first."""
    return np.column_stack([np.repeat(row[:1], max(0, len(row) - 2)), row[1:-1], row[2:]])


def _rows(file: _File, p: Element, stride: int) -> I64:
    found = indices(p.text, int(INVALID))
    if len(found) % stride:
        raise damaged(file.name, f"a row of its indices is not a multiple of {stride:,}")
    return found.reshape(-1, stride)


def _positions(file: _File, reference: str) -> F64:
    """Return the coordinates (n, 3) that the vertices of a set of faces have."""
    vertices = file.find(reference, "vertices")
    for given in vertices.all("input"):
        if given.get("semantic") == "POSITION":
            table = _table(file, given.get("source"))
            if table.shape[1] < 3:
                raise damaged(file.name, "its positions are not three numbers each")
            # The same array for the same vertices: parts then share them.
            return file.positions.setdefault(id(vertices), table[:, :3])
    raise damaged(file.name, "its vertices have no positions")


def _table(file: _File, reference: str) -> F64:
    """Return the rows (n, named parameters) of a source, checked against all its counts."""
    source = file.find(reference, "source")
    if id(source) in file.tables:
        return file.tables[id(source)]
    common = source.first("technique_common")
    accessor = common.first("accessor") if common else None
    if accessor is None:
        raise damaged(file.name, "a source of numbers in it does not say how to read them")
    array = file.find(accessor.get("source"), "float_array", "Name_array", "IDREF_array")
    if array.tag != "float_array":
        return np.empty((0, 0))
    values = numbers(array.text)
    announced = _whole(file, array.get("count"), "a count")
    if len(values) != announced:
        raise damaged(file.name, f"it announces {announced:,} numbers and holds {len(values):,}")
    count = _whole(file, accessor.get("count"), "a count")
    stride = _whole(file, accessor.get("stride", "1"), "a stride")
    offset = _whole(file, accessor.get("offset", "0"), "an offset")
    # A parameter without a name is one to be passed over; where none has a name all count.
    params = [bool(p.get("name")) for p in accessor.all("param")] or [True] * min(stride, 16)
    used = np.flatnonzero(params if any(params) else [True] * len(params))
    if len(params) > stride or offset + count * stride > len(values):
        raise damaged(file.name, "a source of numbers in it reaches beyond their end")
    rows = values[offset : offset + count * stride].reshape(count, stride)
    file.tables[id(source)] = rows[:, used]
    return file.tables[id(source)]


def _whole(file: _File, word: str, what: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 10):
        raise damaged(file.name, f"{what} in it is “{shown(word[:60])}”, not a whole number")
    return int(word)


def _unread(file: _File, fact: str) -> FileError:
    return FileError(f"“{file.name}” {fact}, which is not read. Save it as OBJ, PLY or STL.")


def _miscounted(file: _File, primitive: Element, count: int, found: int) -> FileError:
    return damaged(
        file.name, f"a set of {primitive.tag} in it announces {count:,} and holds {found:,}"
    )
