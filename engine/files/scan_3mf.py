"""3MF: a ZIP archive of XML; objects with meshes, put together by components and build items."""

from __future__ import annotations

import io
import posixpath
import struct
import zipfile
import zlib
from dataclasses import dataclass, field

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.markup import read_markup
from engine.files.report import Change, counted, shown
from engine.files.soup import INVALID, Soup

# A model of text is seldom squeezed to less than a twentieth; a bomb to a thousandth.
_RATIO = 200
_SMALL = 16 << 20
_UNPACKED = 2 << 30
_PLACED = 50_000_000
_DEPTH = 100

_UNPACKING_ERRORS = (
    zipfile.BadZipFile, zlib.error, struct.error, NotImplementedError, OSError, EOFError,
    RuntimeError, ValueError,
)  # fmt: skip

Key = tuple[str, str]


@dataclass
class _Object:
    vertices: list[tuple[str, str, str]] = field(default_factory=list)
    triangles: list[tuple[str, str, str]] = field(default_factory=list)
    parts: list[tuple[Key, str]] = field(default_factory=list)


@dataclass
class _Model:
    objects: dict[Key, _Object] = field(default_factory=dict)
    items: list[tuple[Key, str]] = field(default_factory=list)
    unit: str = "millimeter"


def scan_3mf(data: bytes, name: str) -> Soup:
    """Return what a 3MF's build places, each object as often as it is placed.

    Raises
    ------
    FileError
        The archive or its model is damaged, unpacks to an absurd size, or refers to itself.
    """
    texts = _model_texts(data, name)
    model = _Model()
    for i, (part, text) in enumerate(texts.items()):
        _read_model(text, part, i == 0, model, name)
    placed = model.items or [(key, "") for key, o in model.objects.items() if o.vertices]
    _refuse_loops(model, placed, name)
    meshes = {key: _arrays(o) for key, o in model.objects.items() if o.vertices or o.triangles}
    used: set[Key] = set()
    vertices: list[F64] = [np.empty((0, 3))]
    corners: list[I64] = [np.empty(0, np.int64)]
    waiting = [(key, [transform]) for key, transform in reversed(placed)]
    total = 0
    while waiting:
        key, transforms = waiting.pop()
        used.add(key)
        if key in meshes:
            v, f = meshes[key]
            inside = (f >= 0) & (f < len(v))
            corners.append(np.where(inside, f + total, INVALID).ravel())
            for transform in reversed(transforms):
                v = _moved(v, transform, name)
            vertices.append(v)
            total += len(v)
        more = [(k, [*transforms, t]) for k, t in model.objects[key].parts]
        waiting.extend(reversed(more))
    notes = _notes(model, meshes.keys() - used)
    all_corners = np.concatenate(corners)
    faces = len(all_corners) // 3
    return Soup(
        "3MF", np.concatenate(vertices), all_corners, np.full(faces, 3), total, faces, notes
    )


def _notes(model: _Model, unused: set[Key]) -> list[Change]:
    notes = []
    if unused:
        faces = sum(len(model.objects[k].triangles) for k in unused)
        vertices = sum(len(model.objects[k].vertices) for k in unused)
        notes.append(
            Change(
                "not_placed",
                f"{counted(len(unused), 'object')} that the file does not place left out.",
                vertices,
                faces,
                lost=True,
            )
        )
    if model.unit != "millimeter":
        unit = shown(model.unit[:60])
        notes.append(
            Change("unit", f"The file's unit is {unit}; the numbers were kept as they are.")
        )
    return notes


def _model_texts(data: bytes, name: str) -> dict[str, bytes]:
    """Return the XML of the archive's model parts, the root part first."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            _refuse_bomb(archive, len(data), name)
            parts = [i for i in archive.infolist() if i.filename.lower().endswith(".model")]
            if not parts:
                raise _damaged(name, "its archive holds no model")
            _refuse_unreadable(parts, name)
            root = _root_part(archive)
            parts.sort(key=lambda i: "/" + i.filename.lstrip("/") != root)
            return {"/" + i.filename.lstrip("/"): _unpacked(archive, i, name) for i in parts}
    except _UNPACKING_ERRORS:
        raise _damaged(name, "its archive cannot be unpacked") from None


def _refuse_bomb(archive: zipfile.ZipFile, packed: int, name: str) -> None:
    whole = sum(i.file_size for i in archive.infolist())
    if whole > _UNPACKED or (whole > _SMALL and whole > _RATIO * packed):
        raise FileError(
            f"“{name}” would unpack from {packed / 1e6:.1f} MB to {whole / 1e6:,.0f} MB, which no "
            "model does. Export the model again or get another copy of the file."
        )


def _refuse_unreadable(parts: list[zipfile.ZipInfo], name: str) -> None:
    if any(i.flag_bits & 1 for i in parts):
        raise FileError(
            f"“{name}” is protected by a password and cannot be read. Save it without one."
        )
    if len({i.filename.lstrip("/") for i in parts}) < len(parts):
        raise _damaged(name, "its archive holds a model twice")


def _unpacked(archive: zipfile.ZipFile, item: zipfile.ZipInfo, name: str) -> bytes:
    # The directory may lie about sizes: never take more than it says.
    with archive.open(item) as stream:
        text = stream.read(item.file_size + 1)
    if len(text) > item.file_size:
        raise _damaged(name, "its archive lies about the sizes in it")
    return text


def _root_part(archive: zipfile.ZipFile) -> str:
    found = "/3D/3dmodel.model"

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal found
        if tag == "Relationship" and attributes.get("Type", "").endswith("/3dmodel"):
            found = "/" + posixpath.normpath(attributes.get("Target", found)).lstrip("/")

    try:
        read_markup(archive.read("_rels/.rels"), "_rels/.rels", start)
    except (KeyError, FileError):
        return found
    return found


def _read_model(text: bytes, part: str, is_root: bool, model: _Model, name: str) -> None:
    current = _Object()

    def key(attributes: dict[str, str]) -> Key:
        path = next((v for k, v in attributes.items() if k.rpartition(":")[2] == "path"), part)
        return "/" + path.lstrip("/"), attributes.get("objectid", "")

    def start(tag: str, a: dict[str, str]) -> None:
        nonlocal current
        if tag == "vertex":
            current.vertices.append((a.get("x", ""), a.get("y", ""), a.get("z", "")))
        elif tag == "triangle":
            current.triangles.append((a.get("v1", ""), a.get("v2", ""), a.get("v3", "")))
        elif tag == "object":
            own = part, a.get("id", "")
            if own in model.objects:
                raise _damaged(name, f"it holds two objects of the number “{shown(own[1][:60])}”")
            current = model.objects[own] = _Object()
        elif tag == "component":
            current.parts.append((key(a), a.get("transform", "")))
        elif tag == "item" and is_root:
            model.items.append((key(a), a.get("transform", "")))
        elif tag == "model" and is_root:
            model.unit = a.get("unit", "millimeter")

    def end(tag: str) -> None:
        nonlocal current
        if tag == "object":
            # What extensions keep beside objects, as slices, has vertices too.
            current = _Object()

    read_markup(text, name, start, end)


def _refuse_loops(model: _Model, placed: list[tuple[Key, str]], name: str) -> None:
    """Refuse parts that hold themselves, that are missing, or that multiply beyond all bounds."""
    sizes: dict[Key, int] = {}
    open_now: set[Key] = set()

    def size(key: Key, depth: int) -> int:
        if key not in model.objects:
            missing = shown(key[1][:60])
            raise _damaged(name, f"it refers to the object “{missing}”, which it does not hold")
        if key in open_now:
            raise _damaged(name, "an object is a part of itself")
        if depth > _DEPTH:
            raise _damaged(name, f"its parts are held in each other more than {_DEPTH} deep")
        if key not in sizes:
            open_now.add(key)
            own = model.objects[key]
            # Counted at least once each, so that empty objects cannot multiply unseen either.
            sizes[key] = (
                1
                + len(own.vertices)
                + len(own.triangles)
                + sum(size(k, depth + 1) for k, _ in own.parts)
            )
            open_now.discard(key)
        return sizes[key]

    if sum(size(key, 0) for key, _ in placed) > _PLACED:
        raise _damaged(name, "its parts multiply beyond what any model has")


def _arrays(o: _Object) -> tuple[F64, I64]:
    v = _floats([c for row in o.vertices for c in row]).reshape(-1, 3)
    f = _floats([c for row in o.triangles for c in row]).reshape(-1, 3)
    whole = (f == np.floor(f)) & (np.abs(f) < 2.0**53)
    return v, np.where(whole, f, float(INVALID)).astype(np.int64)


def _floats(words: list[str]) -> F64:
    try:
        return np.array(words, dtype=np.float64) if words else np.empty(0)
    except ValueError:
        return np.array([_float(w) for w in words])


def _float(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def _moved(v: F64, transform: str, name: str) -> F64:
    """Return v M + t of the twelve numbers of a 3MF transform; the same array for none."""
    if not transform:
        return v
    numbers = _floats(transform.split())
    if len(numbers) != 12 or not np.isfinite(numbers).all():
        raise _damaged(name, "a transform is not twelve numbers")
    rows = numbers.reshape(4, 3)
    if (rows == np.eye(4, 3)).all():
        return v
    with np.errstate(all="ignore"):
        return np.asarray(v @ rows[:3] + rows[3])


def _damaged(name: str, fact: str) -> FileError:
    return FileError(
        f"“{name}” is damaged: {fact}. Export the model again or get another copy of the file."
    )
