"""A history as plain JSON and arrays that are stored once: what archive and journal both write.

A mesh whose faces were seen before is written as the rows that differ from the first mesh with
these faces, bit for bit; nothing depends on a chain of earlier steps.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.arrays import I64
from engine.document import Document, Moment
from engine.mesh import Mesh
from engine.plain import INLINE, to_plain
from engine.recipe import Step, UnknownStep

APART = ("original", "mesh", "recipe")
"""Fields of a document that have tables of their own."""

Store = Callable[[str, NDArray[Any]], None]
Enter = Callable[[str, str, dict[str, Any]], None]


def stored_form(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` as it is written: C order, little-endian, ids in 4 bytes where they fit."""
    kind = array.dtype.kind
    if kind in "iu":
        small = array.size == 0 or (array.min() >= -(2**31) and array.max() < 2**31)
        return np.ascontiguousarray(array, dtype="<i4" if small else "<i8")
    return np.ascontiguousarray(array, dtype={"f": "<f8", "b": "|b1"}[kind])


def json_bytes(data: Any) -> bytes:
    """Return JSON data as bytes that `json.loads` reads.

    A file's name may hold bytes that are no text; Python keeps them as surrogates, and so do these.
    """
    return json.dumps(data, allow_nan=False, ensure_ascii=False).encode("utf-8", "surrogatepass")


def array_key(array: NDArray[Any]) -> str:
    """Return the SHA-256 of a stored array's type, shape and bytes, 64 hexadecimal digits."""
    digest = hashlib.sha256(f"{array.dtype.str}{array.shape}".encode())
    digest.update(array.data if array.size else b"")
    return digest.hexdigest()


class KeysByIdentity:
    """Keys of objects that never change, remembered for as long as the objects live."""

    def __init__(self) -> None:
        self._keys: dict[int, tuple[weakref.ref[Any], str]] = {}

    def get(self, thing: Any) -> str | None:
        """Return the key of this very object, or None."""
        found = self._keys.get(id(thing))
        return found[1] if found is not None and found[0]() is thing else None

    def set(self, thing: Any, key: str) -> None:
        """Remember the key of an object."""
        number = id(thing)
        # An id is used again once its object is gone: only the entry that is still ours may go.
        self._keys[number] = (weakref.ref(thing, lambda gone: self._forget(number, gone)), key)

    def _forget(self, number: int, gone: weakref.ref[Any]) -> None:
        if self._keys.get(number, (None,))[0] is gone:
            del self._keys[number]


class Packer:
    """Turns documents into JSON; every array, mesh and step is handed out once.

    Parameters
    ----------
    store : called with (key, array in its stored form) for every array not seen before.
    enter : called with (table, key, entry) for every mesh and step not seen before; whatever an
        entry refers to has been handed out by then.
    """

    def __init__(self, store: Store, enter: Enter) -> None:
        self._store = store
        self._enter = enter
        self._stored: set[str] = set()
        self._arrays = KeysByIdentity()
        self._meshes = KeysByIdentity()
        self._steps = KeysByIdentity()
        self._bases: dict[str, tuple[str, Mesh]] = {}
        self._count = 0

    def array(self, array: NDArray[Any]) -> str:
        """Return the key of an array, storing it if it is new."""
        key = self._arrays.get(array)
        if key is None:
            form = stored_form(array)
            key = array_key(form)
            if key not in self._stored:
                self._stored.add(key)
                self._store(key, form)
            if not array.flags.writeable:
                self._arrays.set(array, key)
        return key

    def mesh(self, mesh: Mesh) -> str:
        """Return the key of a mesh, entering it if it is new."""
        key = self._meshes.get(mesh)
        if key is None:
            faces = self.array(mesh.faces)
            base = self._bases.get(faces)
            entry = None if base is None else self._rows(mesh, *base)
            if entry is None:
                entry = {"faces": faces, "vertices": self.array(mesh.vertices)}
            key = self._entered("meshes", "m", entry)
            self._meshes.set(mesh, key)
            self._bases.setdefault(faces, (key, mesh))
        return key

    def _rows(self, mesh: Mesh, base_key: str, base: Mesh) -> dict[str, Any] | None:
        if mesh.n != base.n:
            return None
        rows = moved_rows(mesh, base)
        if 2 * len(rows) > mesh.n:
            return None
        values = self.array(mesh.vertices[rows])
        return {"base": base_key, "rows": self.array(rows), "values": values}

    def step(self, step: Step) -> str:
        """Return the key of a step, entering it if it is new."""
        key = self._steps.get(step)
        if key is None:
            kind = step.name if isinstance(step, UnknownStep) else step.kind
            data = step.to_json()
            json.dumps(data, allow_nan=False)
            entry: dict[str, Any] = {"kind": kind, "data": data}
            if not _mentions(data, "array"):
                entry["data"] = self._lists_apart(data)
                entry["apart"] = True
            key = self._entered("steps", "s", entry)
            self._steps.set(step, key)
        return key

    def _lists_apart(self, data: Any) -> Any:
        """Return JSON data with its long lists of numbers stored as arrays."""
        if isinstance(data, dict):
            return {key: self._lists_apart(entry) for key, entry in data.items()}
        if not isinstance(data, list | tuple):
            return data
        array = _numbers(data)
        if array is not None and array.size >= INLINE:
            return {"array": self.array(array)}
        return [self._lists_apart(entry) for entry in data]

    def _entered(self, table: str, letter: str, entry: dict[str, Any]) -> str:
        key = f"{letter}{self._count}"
        self._count += 1
        self._enter(table, key, entry)
        return key

    def document(self, document: Document) -> dict[str, Any]:
        """Return a document as JSON data."""
        recipe = document.recipe
        data: dict[str, Any] = {
            "original": self.mesh(document.original),
            "mesh": self.mesh(document.mesh),
            "steps": [self.step(step) for step in recipe.steps],
            "digest": recipe.digest,
            "muted": sorted(recipe.muted),
        }
        for field in dataclasses.fields(document):
            if field.name not in APART:
                data[field.name] = to_plain(getattr(document, field.name), self.array)
        return data

    def moment(self, moment: Moment) -> dict[str, Any]:
        """Return a moment of the history as JSON data."""
        return {
            "id": moment.id,
            "parent": moment.parent,
            "label": moment.label,
            "name": moment.name,
            "time": moment.time,
            "document": self.document(moment.document),
        }


def moved_rows(mesh: Mesh, base: Mesh) -> I64:
    """Return the vertices of `mesh` that are elsewhere in `base`, by a single bit or more."""
    # Compared as bit patterns: -0.0 and 0.0 are not the same bytes.
    differs = (mesh.vertices.view(np.int64) != base.vertices.view(np.int64)).any(axis=1)
    return np.flatnonzero(differs)


def stored_key(array: NDArray[Any]) -> str:
    """Return the key of an array as it would be stored."""
    return array_key(stored_form(array))


def _mentions(data: Any, word: str) -> bool:
    if isinstance(data, dict):
        return word in data or any(_mentions(entry, word) for entry in data.values())
    return isinstance(data, list | tuple) and any(
        _mentions(entry, word) for entry in data if isinstance(entry, dict | list | tuple)
    )


def _numbers(data: list[Any] | tuple[Any, ...]) -> NDArray[Any] | None:
    """Return a list of numbers of one type, flat or in equal rows, as an array; else None."""
    if not data:
        return None
    if all(type(entry) in (list, tuple) for entry in data):
        flat = [number for row in data for number in row]
        if len({len(row) for row in data}) != 1:
            return None
    else:
        flat = list(data)
    kinds = set(map(type, flat))
    if kinds == {int}:
        if not -(2**63) <= min(flat) <= max(flat) < 2**63:
            return None
        return np.array(data, dtype=np.int64)
    return np.array(data, dtype=np.float64) if kinds == {float} else None
