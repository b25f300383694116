"""glTF and GLB: the checks before native code may read one."""

from __future__ import annotations

import json
import math
from typing import Any
from urllib.parse import unquote

from engine.errors import FileError

_COMPONENT = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_DEPTH = 64
_PLACED = 50_000_000


def check_gltf(data: bytes, name: str) -> tuple[int, list[str]]:
    """Return how many triangles the scene places, and which other files it needs.

    Raises
    ------
    FileError
        Its JSON is damaged, an index or a length reaches outside, or a node holds itself.
    """
    try:
        text, binary = _parts(data)
        scene = json.loads(text, parse_float=_finite, parse_constant=_finite)
        _check_lengths(scene, binary)
        faces = _faces_placed(scene)
        needed = [unquote(b["uri"]) for b in scene.get("buffers", []) if _is_file(b)]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        why = (
            str(error)
            if isinstance(error, _WrongError)
            else "its description does not hold together"
        )
        raise FileError(
            f"“{name}” is damaged: {why}. Export the model again or get another copy of the file."
        ) from None
    return faces, needed


def without_materials(data: bytes) -> bytes:
    """Return the same model, checked before, without materials, textures and pictures.

    A picture that native code cannot decode would cost the mesh; one may also be any path.
    """
    scene = json.loads(_parts(data)[0])
    for unused in ("materials", "textures", "images", "samplers"):
        scene.pop(unused, None)
    for mesh in scene.get("meshes", []):
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
    text = json.dumps(scene).encode()
    if data[:4] != b"glTF":
        return text
    text += b" " * (-len(text) % 4)
    rest = data[20 + int.from_bytes(data[12:16], "little") :]
    whole = len(text).to_bytes(4, "little") + b"JSON" + text + rest
    return data[:8] + (12 + len(whole)).to_bytes(4, "little") + whole


class _WrongError(ValueError):
    """A check that failed; the text says which."""


def _parts(data: bytes) -> tuple[bytes, int]:
    """Return the JSON text and the length of the binary part."""
    if data[:4] != b"glTF":
        return data, 0
    if int.from_bytes(data[8:12], "little") != len(data):
        raise _WrongError("its length is not what its header says")
    length = int.from_bytes(data[12:16], "little")
    if data[16:20] != b"JSON" or 20 + length > len(data):
        raise _WrongError("its first part is not its description")
    rest = 20 + length
    if rest == len(data):
        return data[20:rest], 0
    binary = int.from_bytes(data[rest : rest + 4], "little")
    if rest + 8 + binary > len(data):
        raise _WrongError("its binary part is cut off")
    return data[20:rest], binary


def _is_file(buffer: dict[str, Any]) -> bool:
    uri = buffer.get("uri")
    return isinstance(uri, str) and not uri.startswith("data:")


def _finite(word: str) -> float:
    number = float(word)
    if not math.isfinite(number):
        raise _WrongError("a number in its description is not finite")
    return number


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**40:
        raise _WrongError("a length in it is not a whole number")
    return value


def _check_lengths(scene: dict[str, Any], binary: int) -> None:
    buffers = scene.get("buffers", [])
    for i, buffer in enumerate(buffers):
        if "uri" not in buffer and (i > 0 or _whole(buffer["byteLength"]) > binary):
            raise _WrongError("it announces more data than it holds")
    views = scene.get("bufferViews", [])
    for view in views:
        end = _whole(view.get("byteOffset", 0)) + _whole(view["byteLength"])
        if end > _whole(buffers[_whole(view["buffer"])]["byteLength"]):
            raise _WrongError("a part of its data reaches beyond the end")
    for accessor in scene.get("accessors", []):
        width = _COMPONENT[accessor["componentType"]] * _WIDTH[accessor["type"]]
        count = _whole(accessor["count"])
        if "bufferView" not in accessor:
            if count > _PLACED:
                raise _WrongError("it announces more data than it holds")
            continue
        view = views[_whole(accessor["bufferView"])]
        stride = _whole(view.get("byteStride", 0)) or width
        used = _whole(accessor.get("byteOffset", 0)) + (count - 1) * stride + width if count else 0
        if used > view["byteLength"]:
            raise _WrongError("a part of its data reaches beyond the end")


def _faces_placed(scene: dict[str, Any]) -> int:
    """Return how many triangles all nodes place; refuses nodes that hold themselves."""
    nodes, meshes = scene.get("nodes", []), scene.get("meshes", [])
    faces = [_faces(scene, mesh) for mesh in meshes]
    scenes = scene.get("scenes", [])
    roots = scenes[scene.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
    total, visited = 0, 0
    waiting = [(int(root), 1) for root in roots]
    while waiting:
        index, depth = waiting.pop()
        visited += 1
        if depth > _DEPTH or visited > 1_000_000 or index < 0:
            raise _WrongError(
                "a node of its scene holds itself, or the scene is nested absurdly deep"
            )
        node = nodes[index]
        if "mesh" in node:
            total += faces[_whole(node["mesh"])]
        if total > _PLACED:
            raise _WrongError("its parts multiply beyond what any model has")
        waiting += [(int(child), depth + 1) for child in node.get("children", [])]
    return total


def _faces(scene: dict[str, Any], mesh: dict[str, Any]) -> int:
    accessors = scene.get("accessors", [])
    total = 0
    for primitive in mesh["primitives"]:
        position = accessors[_whole(primitive["attributes"]["POSITION"])]
        if position["type"] != "VEC3" or position["componentType"] != 5126:
            raise _WrongError("its positions are not three numbers each")
        indexed = "indices" in primitive
        count = _whole((accessors[_whole(primitive["indices"])] if indexed else position)["count"])
        mode = primitive.get("mode", 4)
        total += count // 3 if mode == 4 else max(0, count - 2) if mode in (5, 6) else 0
    return total
