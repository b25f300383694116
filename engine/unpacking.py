"""Documents built again from what `engine.packing` wrote; nothing read is taken on trust."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine.applied import applied
from engine.arrays import frozen
from engine.document import Document, Moment
from engine.edit import check_options, check_stroke
from engine.errors import EngineError, FileError
from engine.mesh import Mesh
from engine.packing import moved_rows, stored_key
from engine.plain import Fetch, dataclass_from_plain
from engine.recipe import Kinds, Recipe, Step, UnknownStep
from engine.run import Run

MOST_IDS_IN_ALL = 500_000_000
_RANGES = re.compile(r"[0-9][0-9 -]*")


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
            keys = (stored_key(mesh.faces), stored_key(mesh.vertices))
            return keys == (entry["faces"], entry.get("vertices"))
        base = self.mesh(entry.get("base"))
        if mesh.n != base.n or not np.array_equal(mesh.faces, base.faces):
            return False
        rows = moved_rows(mesh, base)
        keys = (stored_key(rows), stored_key(mesh.vertices[rows]))
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
