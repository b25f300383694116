"""X3D: shapes in a tree of groups and transforms, in its XML encoding."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from engine.arrays import F64, I64
from engine.files.gathered import Gathered, Piece
from engine.files.markup import Element, indices, numbers, read_tree
from engine.files.report import Change, counted, shown
from engine.files.scan_dae import fan, rotation, strip
from engine.files.soup import INVALID, Soup, damaged

_DEPTH = 100
_GROUPS = (
    "Scene", "Group", "StaticGroup", "Transform", "Collision", "Anchor", "Billboard", "Switch",
    "LOD", "CADLayer", "CADAssembly", "CADPart", "CADFace", "X3D",
)  # fmt: skip
_SURFACES = (
    "IndexedFaceSet", "IndexedTriangleSet", "IndexedTriangleStripSet", "IndexedTriangleFanSet",
    "IndexedQuadSet", "TriangleSet", "TriangleStripSet", "TriangleFanSet", "QuadSet",
)  # fmt: skip
_UNREAD = (
    "Box", "Sphere", "Cone", "Cylinder", "ElevationGrid", "Extrusion", "Text", "Rectangle2D",
    "Disk2D", "TriangleSet2D", "NurbsPatchSurface", "NurbsTrimmedSurface", "Inline",
    "ProtoInstance",
)  # fmt: skip


@dataclass
class _File:
    name: str
    known: dict[str, Element]
    made: dict[int, Piece] = field(default_factory=dict)
    points: dict[int, F64] = field(default_factory=dict)
    unread: Counter[str] = field(default_factory=Counter)

    def meant(self, element: Element) -> Element:
        """Return the element itself, or the one that it says to use."""
        use = element.get("USE")
        if not use:
            return element
        found = self.known.get(use)
        if found is None or found.tag != element.tag:
            raise damaged(
                self.name, f"it uses “{shown(use[:60])}”, which is no {element.tag} in it"
            )
        return found


def scan_x3d(data: bytes, name: str) -> Soup:
    """Return the polygons of all shapes where the scene places them.

    Raises
    ------
    FileError
        It is no XML, coordinates are not three numbers each, or a node uses itself.
    """
    root = read_tree(data, name)
    known: dict[str, Element] = {}
    for element in root.walk():
        if "DEF" in element.attributes:
            known.setdefault(element.attributes["DEF"], element)
    file = _File(name, known)
    gathered = Gathered(name)
    waiting = [(root, np.eye(4), 1)]
    while waiting:
        element, matrix, depth = waiting.pop()
        element = file.meant(element)
        gathered.visit()
        if depth > _DEPTH:
            raise damaged(name, "a part of it holds itself, or is nested absurdly deep")
        if element.tag == "Transform":
            with np.errstate(all="ignore"):
                matrix = matrix @ _transform(file, element)
        if element.tag == "Shape":
            _place(file, gathered, element, matrix)
        elif element.tag in _GROUPS:
            inner = _shown_children(file, element)
            waiting.extend((child, matrix, depth + 1) for child in reversed(inner))
        elif element.tag in _UNREAD:
            file.unread[element.tag] += 1
    notes = [
        Change("unread", f"{counted(n, tag)} left out: only meshes are read.", lost=True)
        for tag, n in sorted(file.unread.items())
    ]
    return gathered.soup("X3D", notes)


def _shown_children(file: _File, element: Element) -> list[Element]:
    """Return what a group shows: of a Switch the chosen child, of a LOD the finest."""
    children = [c for c in element.children if not c.tag.startswith("Metadata")]
    if element.tag == "Switch":
        chosen = _integer(file, element.get("whichChoice", "-1"))
        return children[chosen : chosen + 1] if chosen >= 0 else []
    return children[:1] if element.tag == "LOD" else children


def _place(file: _File, gathered: Gathered, shape: Element, matrix: F64) -> None:
    for child in shape.children:
        geometry = file.meant(child)
        if geometry.tag in _UNREAD:
            file.unread[geometry.tag] += 1
        if geometry.tag in _SURFACES:
            if id(geometry) not in file.made:
                file.made[id(geometry)] = _surface(file, geometry)
            gathered.place(file.made[id(geometry)], matrix)


def _surface(file: _File, geometry: Element) -> Piece:
    """Return the polygons of a geometry node, turned where it says that they run clockwise."""
    points = _points(file, geometry)
    if geometry.tag == "IndexedFaceSet":
        corners, sizes = _cut(_listed(geometry, "coordIndex"))
    else:
        corners, sizes = _regular(file, geometry, len(points))
    piece = Piece(points, corners, sizes)
    return piece.turned() if geometry.get("ccw").strip().lower() == "false" else piece


def _regular(file: _File, geometry: Element, n: int) -> tuple[I64, I64]:
    """Return the corners and sizes of sets of triangles, strips, fans or quads."""
    indexed = geometry.tag.startswith("Indexed")
    listed = _listed(geometry, "index") if indexed else np.arange(n)
    kind = geometry.tag.removeprefix("Indexed").removesuffix("Set")
    if kind in ("Triangle", "Quad"):
        each = 3 if kind == "Triangle" else 4
        if len(listed) % each:
            raise damaged(file.name, f"the corners of a {geometry.tag} are no multiple of {each}")
        return listed, np.full(len(listed) // each, each)
    corners, sizes = _cut(listed) if indexed else (listed, _counts(file, geometry, kind, n))
    rows = np.split(corners, np.cumsum(sizes)[:-1])
    pieces = [strip(row) if kind == "TriangleStrip" else fan(row) for row in rows if len(row) > 2]
    triangles = np.concatenate([np.empty((0, 3), np.int64), *pieces])
    return triangles.ravel(), np.full(len(triangles), 3)


def _counts(file: _File, geometry: Element, kind: str, n: int) -> I64:
    """Return how many vertices each strip or fan has that takes them one after the other."""
    field_name = "stripCount" if kind == "TriangleStrip" else "fanCount"
    sizes = _listed(geometry, field_name)
    if (sizes < 0).any() or int(sizes.sum()) != n:
        raise damaged(file.name, f"the {field_name} of a {geometry.tag} is not its points' number")
    return sizes


def _cut(listed: I64) -> tuple[I64, I64]:
    """Return the corners and sizes of polygons that are ended by -1, the last perhaps by nothing.

    Two ends in a row hold nothing and are no polygon.
    """
    ends = listed == -1
    number = np.cumsum(ends)[~ends]
    sizes = np.bincount(number) if len(number) else np.empty(0, np.int64)
    return listed[~ends], sizes[sizes > 0].astype(np.int64)


def _points(file: _File, geometry: Element) -> F64:
    """Return the coordinates (n, 3) of a geometry node."""
    node = geometry.first("Coordinate", "CoordinateDouble")
    if node is None:
        raise damaged(file.name, f"a {geometry.tag} in it has no coordinates")
    node = file.meant(node)
    if id(node) not in file.points:
        found = numbers(node.get("point").replace(",", " "))
        if len(found) % 3:
            raise damaged(
                file.name, f"it holds {len(found):,} coordinates of points, not three for each"
            )
        file.points[id(node)] = found.reshape(-1, 3)
    return file.points[id(node)]


def _listed(element: Element, attribute: str) -> I64:
    return indices(element.get(attribute).replace(",", " "), int(INVALID))


def _transform(file: _File, element: Element) -> F64:
    """Return T C R SR S SR⁻¹ C⁻¹, as X3D defines its Transform."""
    center = _field(file, element, "center", [0, 0, 0])
    turn = _field(file, element, "rotation", [0, 0, 1, 0])
    across = _field(file, element, "scaleOrientation", [0, 0, 1, 0])
    skewed = rotation(across[:3], float(across[3]))
    scale = np.diag(_field(file, element, "scale", [1, 1, 1]))
    whole = np.eye(4)
    whole[:3, :3] = rotation(turn[:3], float(turn[3])) @ skewed @ scale @ skewed.T
    moved = _field(file, element, "translation", [0, 0, 0]) + center
    whole[:3, 3] = moved - whole[:3, :3] @ center
    return whole


def _field(file: _File, element: Element, attribute: str, otherwise: list[float]) -> F64:
    if attribute not in element.attributes:
        return np.array(otherwise, dtype=np.float64)
    found = numbers(element.get(attribute).replace(",", " "))
    if len(found) != len(otherwise) or not np.isfinite(found).all():
        raise damaged(file.name, f"the {attribute} of a part is not {len(otherwise)} numbers")
    return found


def _integer(file: _File, word: str) -> int:
    found = indices(word, int(INVALID))
    if len(found) != 1 or found[0] == INVALID:
        raise damaged(file.name, "the choice of a Switch is not a whole number")
    return int(found[0])
