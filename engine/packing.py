"""A history as plain JSON and arrays that are stored once: what archive and journal both write.

A mesh whose faces were seen before is written as the rows that differ from the first mesh with
these faces, bit for bit; nothing depends on a chain of earlier steps.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import weakref
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.applied import applied
from engine.arrays import I64, frozen
from engine.document import Document, HistoryState, Moment
from engine.edit import check_options, check_stroke
from engine.errors import Cancelled, EngineError, FileError
from engine.mesh import Mesh
from engine.plain import INLINE, Fetch, dataclass_from_plain, to_plain
from engine.recipe import Kinds, Recipe, Step, UnknownStep
from engine.run import Run

APART = ("original", "mesh", "recipe")
"""Fields of a document that have tables of their own."""

MOST_IDS_IN_ALL = 500_000_000
_RANGES = re.compile(r"[0-9][0-9 -]*")

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
        rows = _moved_rows(mesh, base)
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


def _moved_rows(mesh: Mesh, base: Mesh) -> I64:
    """Return the vertices of `mesh` that are elsewhere in `base`, by a single bit or more."""
    # Compared as bit patterns: -0.0 and 0.0 are not the same bytes.
    differs = (mesh.vertices.view(np.int64) != base.vertices.view(np.int64)).any(axis=1)
    return np.flatnonzero(differs)


def _stored_key(array: NDArray[Any]) -> str:
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


class Unpacker:
    """Builds documents again from what a `Packer` handed out.

    Parameters
    ----------
    meshes, steps : the tables, key to entry.
    fetch : returns the array of a key; raises `FileError` when it is not there or damaged.
    kinds : the steps that are known, by their kind.
    """

    def __init__(
        self,
        meshes: Mapping[str, Any],
        steps: Mapping[str, Any],
        fetch: Fetch,
        kinds: Kinds,
    ) -> None:
        self._meshes = meshes
        self._steps = steps
        self._fetch_stored = fetch
        self._kinds = kinds
        self._arrays: dict[str, NDArray[Any]] = {}
        self._recipes: dict[tuple[tuple[str, ...], str, frozenset[int]], Recipe] = {}
        self._made: dict[str, Any] = {}
        self._unfolded = 0
        self._by_faces: dict[tuple[str, int], Mesh] = {}

    def _fetch(self, key: str) -> NDArray[Any]:
        """Return the array of a key; who asks twice gets the same object, as before packing."""
        if key not in self._arrays:
            stored = self._fetch_stored(key)
            self._arrays[key] = frozen(stored, np.int64) if stored.dtype.kind == "i" else stored
        return self._arrays[key]

    def _recipe_of(self, document: dict[str, Any]) -> Recipe:
        """Return a document's recipe; documents that shared one share it again."""
        keys, muted = document.get("steps"), document.get("muted", [])
        if not isinstance(keys, list) or not isinstance(muted, list):
            raise FileError("A document in the file has no list of steps.")
        if not all(type(i) is int and 0 <= i < len(keys) for i in muted):
            raise FileError("A document in the file mutes a step that it does not have.")
        digest = str(document.get("digest", ""))
        steps = tuple(self.step(key) for key in keys)
        what = (tuple(keys), digest, frozenset(muted))
        return self._recipes.setdefault(what, Recipe(steps, digest, what[2]))

    def mesh(self, key: Any) -> Mesh:
        """Return the mesh of a key; meshes with the same faces share them."""
        entry = _entry(self._meshes, key, "surface")
        if key not in self._made:
            try:
                self._made[key] = self._full(entry) if "faces" in entry else self._moved(entry)
            except (KeyError, TypeError, ValueError, IndexError) as error:
                raise FileError(f"A surface in the file cannot be read: {error}.") from error
        found: Mesh = self._made[key]
        return found

    def _full(self, entry: dict[str, Any]) -> Mesh:
        vertices = self._fetch(entry["vertices"])
        if vertices.dtype.kind != "f":
            raise FileError("The positions of a surface in the file are not decimal numbers.")
        shared = self._by_faces.get((entry["faces"], len(vertices)))
        if shared is not None:
            return shared.with_vertices(vertices)
        mesh = Mesh(vertices, self._fetch(entry["faces"]))
        self._by_faces[entry["faces"], len(vertices)] = mesh
        return mesh

    def _moved(self, entry: dict[str, Any]) -> Mesh:
        if "faces" not in _entry(self._meshes, entry["base"], "surface"):
            raise FileError("A surface in the file refers to one that is not complete.")
        base = self.mesh(entry["base"])
        rows = self._fetch(entry["rows"])
        values = self._fetch(entry["values"])
        good = rows.ndim == 1 and rows.dtype.kind == "i" and values.shape == (len(rows), 3)
        if not good or (len(rows) and not 0 <= rows.min() <= rows.max() < base.n):
            raise FileError("The moved points of a surface in the file do not fit it.")
        if len(rows) == 0:
            return base
        vertices = base.vertices.copy()
        vertices[rows] = values
        vertices.flags.writeable = False
        return base.with_vertices(vertices)

    def recompute(self, data: Any, parent: Document | None, run: Run | None) -> None:
        """Make the damaged surface of a document again, by its steps.

        Parameters
        ----------
        data : the document; its surface cannot be read.
        parent : the document that it came from, if that is known; what its steps gave is taken up.
        run : progress, cancel.

        Raises
        ------
        EngineError
            The steps cannot be done, or give another surface than the one that was written: what
            is left of it tells, for every array is named by its digest.
        """
        if not isinstance(data, dict):
            raise FileError("A document in the file has no data.")
        key = str(data.get("mesh"))
        entry = _entry(self._meshes, key, "surface")
        recipe = self._recipe_of(data)
        mesh = self.mesh(data.get("original"))
        done = 0
        if parent is not None and parent.original is mesh and _begins(recipe, parent.recipe):
            mesh, done = parent.mesh, len(parent.recipe.steps)
        for i, step in enumerate(recipe.steps[done:], done):
            if i not in recipe.muted:
                mesh = applied(step, mesh, run)
        if not self._is_written_as(mesh, entry):
            raise FileError("A surface in the file is damaged, and its steps give another one.")
        self._made[key] = mesh
        if "faces" in entry:
            self._by_faces.setdefault((entry["faces"], mesh.n), mesh)

    def _is_written_as(self, mesh: Mesh, entry: dict[str, Any]) -> bool:
        if "faces" in entry:
            keys = (_stored_key(mesh.faces), _stored_key(mesh.vertices))
            return keys == (entry["faces"], entry.get("vertices"))
        base = self.mesh(entry.get("base"))
        if mesh.n != base.n or not np.array_equal(mesh.faces, base.faces):
            return False
        rows = _moved_rows(mesh, base)
        keys = (_stored_key(rows), _stored_key(mesh.vertices[rows]))
        return keys == (entry.get("rows"), entry.get("values"))

    def step(self, key: Any) -> Step:
        """Return the step of a key; one whose kind is not known is kept as it was written."""
        entry = _entry(self._steps, key, "step")
        if key not in self._made:
            kind = entry.get("kind")
            data = entry.get("data")
            data = self._lists_back(data) if entry.get("apart") else data
            if not isinstance(kind, str) or not isinstance(data, dict):
                raise FileError("A step in the file has no kind or no data.")
            self._refuse_flood(data)
            known = self._kinds.get(kind)
            step: Step
            try:
                step = UnknownStep(kind, data) if known is None else known.from_json(data)
            except EngineError:
                raise
            except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
                raise FileError(f"A step in the file ({kind}) cannot be read: {error}.") from error
            self._made[key] = step
        found: Step = self._made[key]
        return found

    def _refuse_flood(self, data: dict[str, Any]) -> None:
        """Refuse a few bytes of ranges that would unfold to more ids than any mesh here has."""
        largest = max((mesh.n for mesh in self._by_faces.values()), default=0)
        ids = _ids_in_texts(data)
        self._unfolded += ids
        if ids > 4 * largest + 1000 or self._unfolded > MOST_IDS_IN_ALL:
            raise FileError("A step in the file names more vertices than any surface in it has.")

    def _lists_back(self, data: Any) -> Any:
        if isinstance(data, dict):
            if set(data) == {"array"} and isinstance(data["array"], str):
                return self._fetch(data["array"]).tolist()
            return {key: self._lists_back(entry) for key, entry in data.items()}
        return [self._lists_back(entry) for entry in data] if isinstance(data, list) else data

    def document(self, data: Any) -> Document:
        """Return a document; its ids are checked against its mesh."""
        if not isinstance(data, dict):
            raise FileError("A document in the file has no data.")
        given: dict[str, Any] = {
            "original": self.mesh(data.get("original")),
            "mesh": self.mesh(data.get("mesh")),
            "recipe": self._recipe_of(data),
        }
        document = dataclass_from_plain(Document, data, self._fetch, given)
        _check_ids(document)
        return document

    def moment(self, data: Any) -> Moment:
        """Return a moment of the history."""
        if not isinstance(data, dict):
            raise FileError("A moment in the file has no data.")
        given = {"document": self.document(data.get("document"))}
        moment = dataclass_from_plain(Moment, data, self._fetch, given)
        if moment.id < 0 or moment.parent == moment.id:
            raise FileError("A moment in the file has a number that cannot be.")
        return moment


def _entry(table: Mapping[str, Any], key: Any, what: str) -> dict[str, Any]:
    entry = table.get(key) if isinstance(key, str) else None
    if not isinstance(entry, dict):
        raise FileError(f"A {what} that the file refers to is not in it.")
    return entry


def _check_ids(document: Document) -> None:
    """Refuse vertex ids that the document's mesh does not have, and a level outside 0 to 1."""
    draft = document.draft
    groups = [stroke.anchors for stroke in draft.strokes] + list(document.regions.values())
    if draft.source is not None:
        groups.append(draft.source.anchors)
    if draft.roi is not None:
        groups.append(draft.roi)
    n = document.mesh.n
    for ids in groups:
        if ids.ndim != 1 or (len(ids) and not 0 <= ids.min() <= ids.max() < n):
            raise FileError(f"A region or curve in the file names a vertex outside 0 to {n - 1}.")
    for stroke in draft.strokes:
        check_stroke(stroke)
    check_options(draft.options)
    if not 0.0 <= draft.level <= 1.0:
        raise FileError(f"The level {draft.level:g} in the file is not between 0 and 1.")


def _ids_in_texts(data: Any) -> int:
    """Count the vertex ids that texts such as “3-17 20” in a step's data would unfold to."""
    if isinstance(data, dict):
        return sum(_ids_in_texts(entry) for entry in data.values())
    if isinstance(data, list):
        return sum(_ids_in_texts(entry) for entry in data if not isinstance(entry, int | float))
    if not isinstance(data, str) or not _RANGES.fullmatch(data):
        return 0
    pairs = (part.split("-") for part in data.split())
    # What is no range, such as “5-” or “-5”, is refused by the step itself.
    whole = ([int(number[:20]) for number in pair] for pair in pairs if all(pair))
    return sum(max(0, pair[-1] - pair[0]) + 1 for pair in whole)


def _begins(recipe: Recipe, with_this: Recipe) -> bool:
    """Whether the steps of `recipe` begin with all those of another one, muted alike."""
    count = len(with_this.steps)
    same = len(recipe.steps) >= count and all(
        a is b for a, b in zip(recipe.steps, with_this.steps, strict=False)
    )
    return same and {i for i in recipe.muted if i < count} == set(with_this.muted)


def readable_moments(
    entries: Iterable[Any], unpacker: Unpacker, run: Run | None = None
) -> tuple[dict[int, Moment], list[str]]:
    """Return the moments that can be read, by id, and a sentence about those that cannot.

    A moment whose surface is damaged comes back where its steps give that very surface again.

    Raises
    ------
    EngineError
        Not one can be read; the reason is that of the first.
    """
    moments: dict[int, Moment] = {}
    broken: list[tuple[Any, EngineError]] = []
    for entry in entries:
        try:
            moment = unpacker.moment(entry)
        except EngineError as error:
            broken.append((entry, error))
        else:
            moments[moment.id] = moment
    if not moments:
        raise broken[0][1] if broken else FileError("It holds no surface.")
    errors: list[EngineError] = []
    for entry, reason in broken:
        try:
            moment = _recomputed(entry, unpacker, moments, run)
        except Cancelled:
            raise
        except EngineError:
            errors.append(reason)
        else:
            moments[moment.id] = moment
    report = []
    total, again = len(moments) + len(errors), len(broken) - len(errors)
    if errors:
        report.append(f"{len(errors)} of {total} states could not be read. {errors[0]}")
    if again:
        report.append(
            f"{again} of {total} states {'was' if again == 1 else 'were'} damaged and computed "
            "again from the steps: to the last bit what had been saved."
        )
    return moments, report


def _recomputed(
    entry: Any, unpacker: Unpacker, moments: Mapping[int, Moment], run: Run | None
) -> Moment:
    """Return a moment after its surface was made again."""
    try:
        # Another moment with the same surface may have come first.
        return unpacker.moment(entry)
    except EngineError:
        if not isinstance(entry, dict):
            raise
    parent = entry.get("parent")
    known = moments.get(parent) if type(parent) is int else None
    unpacker.recompute(entry.get("document"), None if known is None else known.document, run)
    return unpacker.moment(entry)


def redo_links(data: Any) -> dict[int, int]:
    """Return which child redo leads to, as far as `data` can be understood."""
    if not isinstance(data, dict):
        return {}
    return {int(k): v for k, v in data.items() if k.isdecimal() and len(k) < 10 and type(v) is int}


def history_state(
    moments: Mapping[int, Moment], current_id: int, redo: Mapping[int, int]
) -> tuple[HistoryState, int]:
    """Return a whole tree from the moments that could be read, and how many were hung elsewhere.

    A moment whose parent is lost becomes a child of the root; without its root, the tree grows
    from the moment with the smallest number. Whatever was open and is lost gives way to the newest.
    """
    if not moments:
        raise FileError("The file holds no surface that could be read.")
    root = min(moments, key=lambda i: (moments[i].parent is not None, i))
    kept: dict[int, Moment] = {}
    rehung = 0
    for i in sorted(moments, key=lambda i: (i != root, i)):
        moment = moments[i]
        parent = None if i == root else moment.parent
        # Parents are older than their children, so that no ring can form.
        if i != root and (parent not in kept):
            parent = root
            rehung += 1
        kept[i] = dataclasses.replace(moment, parent=parent)
    links = {k: v for k, v in redo.items() if k in kept and v in kept and kept[v].parent == k}
    open_id = current_id if current_id in kept else max(kept)
    return HistoryState(kept, open_id, links), rehung
