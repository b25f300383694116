"""Document (frozen: what is open) and History (a tree of documents: undo, redo, variants)."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeVar

from engine.arrays import I64
from engine.edit import EditOptions, SketchEdit, Source, Stroke
from engine.mesh import Mesh
from engine.recipe import Recipe, Step
from engine.view import View

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Draft:
    """What is being prepared and not yet applied: a region, its level, and the curves drawn so far.

    Parameters
    ----------
    roi : (m,) int64 ascending vertex ids of the region, or None.
    level : level of detail in 0..1 (Eq. 16); 0 shows the base shape.
    source : the source curve that waits for its target, or None.
    strokes : source curves with their targets; all are solved together.
    options : how the edit is solved.
    """

    roi: I64 | None = None
    level: float = 0.0
    source: Source | None = None
    strokes: tuple[Stroke, ...] = ()
    options: EditOptions = field(default_factory=EditOptions)

    def with_roi(self, roi: I64 | None) -> Draft:
        """Return the draft with another region, ascending vertex ids (m,), or with none.

        Its curves go; level and options stay.
        """
        return replace(self, roi=roi, source=None, strokes=())

    @property
    def acting(self) -> tuple[Stroke, ...]:
        """The strokes that are not hidden."""
        return tuple(stroke for stroke in self.strokes if not stroke.hidden)

    def edit(self) -> SketchEdit | None:
        """Return the step that `apply` would add, or None while no stroke acts."""
        acting = self.acting
        if self.roi is None or not acting:
            return None
        return SketchEdit(self.roi, self.level, acting, self.options)


@dataclass(frozen=True, eq=False)
class Document:
    """What is open. It never changes: every action makes a new one that shares the arrays.

    Parameters
    ----------
    original : the mesh as it was opened.
    mesh : the mesh with all steps of `recipe` applied.
    recipe : the steps applied so far.
    draft : the edit being prepared.
    name : file name without folder, for the title.
    unit : "mm", "cm", "m" or "in": what one mesh unit is.
    regions : named regions, name to vertex ids.
    views : named cameras.
    """

    original: Mesh
    mesh: Mesh
    recipe: Recipe
    draft: Draft = field(default_factory=Draft)
    name: str = ""
    unit: str = "mm"
    regions: Mapping[str, I64] = field(default_factory=lambda: MappingProxyType({}))
    views: Mapping[str, View] = field(default_factory=lambda: MappingProxyType({}))

    @classmethod
    def open(cls, mesh: Mesh, name: str = "", unit: str = "mm") -> Document:
        """Return the document of a mesh that was just opened."""
        return cls(mesh, mesh, Recipe(digest=mesh.digest), name=name, unit=unit)

    def with_draft(self, draft: Draft) -> Document:
        """Return the document with another draft."""
        return replace(self, draft=draft)

    def with_region(self, name: str, roi: I64 | None) -> Document:
        """Return the document with a region (m,) kept under `name`; None forgets it."""
        return replace(self, regions=_with_entry(self.regions, name, roi))

    def with_view(self, name: str, view: View | None) -> Document:
        """Return the document with a camera kept under `name`; None forgets it."""
        return replace(self, views=_with_entry(self.views, name, view))

    def with_step(self, step: Step, mesh: Mesh) -> Document:
        """Return the document after `step`, whose result on the current mesh is `mesh`.

        The region, its level and hidden curves stay as long as the faces are the same; the other
        curves go.
        """
        same_faces = mesh.faces is self.mesh.faces
        draft = self.draft.with_roi(self.draft.roi if same_faces else None)
        if same_faces:
            aside = tuple(stroke for stroke in self.draft.strokes if stroke.hidden)
            draft = replace(draft, strokes=aside)
        regions = self.regions if same_faces else MappingProxyType({})
        return replace(
            self, mesh=mesh, recipe=self.recipe.with_step(step), draft=draft, regions=regions
        )


def _with_entry(entries: Mapping[str, T], name: str, value: T | None) -> Mapping[str, T]:
    changed = {key: kept for key, kept in entries.items() if key != name}
    if value is not None:
        changed[name] = value
    return MappingProxyType(changed)


@dataclass(frozen=True, eq=False)
class Moment:
    """One place in the history: a document, what led to it, and where it came from."""

    id: int
    parent: int | None
    document: Document
    label: str
    name: str = ""
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class HistoryState:
    """All of a history as it was at one time, for whoever writes it down in another thread.

    Parameters
    ----------
    moments : every moment by its id; the root is the one without a parent.
    current_id : the moment that is open.
    redo : for a moment that was left upwards, the child that redo leads to.
    """

    moments: Mapping[int, Moment]
    current_id: int
    redo: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def current(self) -> Document:
        """The document that is open."""
        return self.moments[self.current_id].document


class History:
    """The tree of all documents since opening; undo and redo walk it, nothing is cut off.

    Parameters
    ----------
    document : the first document.
    label : what the list shows for it.
    """

    def __init__(self, document: Document, label: str = "Opened") -> None:
        self._ids = itertools.count(1)
        root = Moment(0, None, document, label, time=time.time())
        self.moments: dict[int, Moment] = {0: root}
        self.current_id = 0
        self._redo: dict[int, int] = {}

    @classmethod
    def from_state(cls, state: HistoryState) -> History:
        """Return a history that goes on where `state` was taken."""
        history = cls(state.current)
        history.moments = dict(state.moments)
        history.current_id = state.current_id
        history._redo = dict(state.redo)
        history._ids = itertools.count(max(state.moments) + 1)
        return history

    def state(self) -> HistoryState:
        """Return all of it as it is now; what happens later does not change the answer."""
        return HistoryState(dict(self.moments), self.current_id, dict(self._redo))

    @property
    def current(self) -> Document:
        """The document that is open now."""
        return self.moments[self.current_id].document

    def add(self, document: Document, label: str) -> Moment:
        """Make `document` the current one, as a child of the one before."""
        moment = Moment(next(self._ids), self.current_id, document, label, time=time.time())
        self.moments[moment.id] = moment
        self._redo[self.current_id] = moment.id
        self.current_id = moment.id
        return moment

    def amend(self, document: Document) -> None:
        """Replace the current moment's document (a slide of the level is one moment, not fifty)."""
        self.moments[self.current_id] = replace(self.moments[self.current_id], document=document)

    def take_back(self) -> Document:
        """Forget the current moment, which turned out impossible, and return its parent's document.

        Only a moment without children is forgotten; the first one never is.
        """
        moment = self.moments[self.current_id]
        childless = all(other.parent != moment.id for other in self.moments.values())
        if moment.parent is not None and childless:
            del self.moments[moment.id]
            self._redo = {k: v for k, v in self._redo.items() if v != moment.id}
            self.current_id = moment.parent
        return self.current

    @property
    def can_undo(self) -> bool:
        """Whether there is a moment before this one."""
        return self.moments[self.current_id].parent is not None

    @property
    def can_redo(self) -> bool:
        """Whether something was undone from here."""
        return self.current_id in self._redo

    def undo(self) -> Document:
        """Go to the parent, if there is one, and return its document."""
        parent = self.moments[self.current_id].parent
        if parent is not None:
            self._redo[parent] = self.current_id
            self.current_id = parent
        return self.current

    def redo(self) -> Document:
        """Go to the child that was left last, if there is one, and return its document."""
        self.current_id = self._redo.get(self.current_id, self.current_id)
        return self.current

    def go(self, moment_id: int) -> Document:
        """Go to any moment; redo will lead along the way back down to it."""
        child = moment_id
        parent = self.moments[child].parent
        while parent is not None:
            self._redo[parent] = child
            child, parent = parent, self.moments[parent].parent
        self.current_id = moment_id
        return self.current

    def rename(self, moment_id: int, name: str) -> None:
        """Give a moment a name: it is then a variant."""
        self.moments[moment_id] = replace(self.moments[moment_id], name=name)
