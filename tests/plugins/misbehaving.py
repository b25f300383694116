"""Tools and steps as bad as a stranger's can be."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from engine import Mesh
from plugins.api import DataStep, Tool

RELEASE = threading.Event()  # lets what hangs end after the test
FOR_EVER = 30.0
"""How long it hangs when nothing lets it end, in seconds: the test has failed then."""


def unending(begun: float) -> bool:
    """Whether what began to hang at a moment of `time.monotonic` goes on."""
    return not RELEASE.is_set() and time.monotonic() < begun + FOR_EVER


@dataclass(frozen=True, eq=False)
class BadStep(DataStep):
    """Does what `how` says instead of a decent edit."""

    how: str
    kind: ClassVar[str] = "bad"
    label: ClassVar[str] = "Bad"

    def apply(self, mesh: Mesh, run: Any = None) -> Any:
        return getattr(self, f"_{self.how}")(mesh, run)

    def _raises(self, mesh: Mesh, run: Any) -> Any:
        return 1 / 0

    def _exits(self, mesh: Mesh, run: Any) -> Any:
        sys.exit("a script of old")

    def _none(self, mesh: Mesh, run: Any) -> Any:
        return None

    def _text(self, mesh: Mesh, run: Any) -> Any:
        return "a mesh"

    def _not_a_number(self, mesh: Mesh, run: Any) -> Any:
        return mesh.with_vertices(mesh.vertices * np.nan)

    def _smuggled(self, mesh: Mesh, run: Any) -> Any:
        """Get positions that are not finite past the mesh's own check."""
        bad = object.__new__(Mesh)
        bad.vertices = mesh.vertices * np.nan
        bad.faces, bad.topology = mesh.faces, mesh.topology
        return bad

    def _too_few(self, mesh: Mesh, run: Any) -> Any:
        return mesh.with_vertices(mesh.vertices[:-1])

    def _too_many(self, mesh: Mesh, run: Any) -> Any:
        return Mesh(np.concatenate([mesh.vertices, mesh.vertices]), mesh.faces)

    def _far_away(self, mesh: Mesh, run: Any) -> Any:
        return mesh.with_vertices(mesh.vertices * 1e9)

    def _in_place(self, mesh: Mesh, run: Any) -> Any:
        mesh.vertices += 1.0
        return mesh

    def _hangs(self, mesh: Mesh, run: Any) -> Any:
        """Native code that does not come back: nothing can interrupt it."""
        RELEASE.wait(FOR_EVER)
        return mesh

    def _loops(self, mesh: Mesh, run: Any) -> Any:
        """Python that goes round and round, and swallows what it can."""
        begun = time.monotonic()
        while unending(begun):
            try:
                time.sleep(0.001)
            except Exception:  # noqa: BLE001
                continue
        return mesh

    def _copies_faces(self, mesh: Mesh, run: Any) -> Any:
        """This one is fine."""
        return Mesh(mesh.vertices + 1.0, mesh.faces.copy())


STEPS = ("raises", "exits", "none", "text", "not_a_number", "smuggled", "too_few", "too_many",
         "far_away", "in_place")  # fmt: skip


class Bad(Tool):
    """A tool whose gesture does what `how` says."""

    id = "bad"
    title = "Bad"
    how = "raises"

    def gesture(self, context: Any, pointer: Any) -> Any:
        document = context.document
        yield
        if self.how == "raises":
            raise ZeroDivisionError("division by zero")
        if self.how == "exits":
            sys.exit("a script of old")
        if self.how == "text":
            return "done"
        if self.how == "loops":
            begun = time.monotonic()
            while unending(begun):
                pass
        if self.how == "mesh":
            return replace(document, mesh=document.mesh.with_vertices(document.mesh.vertices + 1))
        if self.how == "region":
            return document.with_draft(document.draft.with_roi(np.array([10**9])))
        if self.how == "level":
            return document.with_draft(replace(document.draft, level=7.0))
        if self.how == "preview":
            context.preview("a picture")
        if self.how == "mark":
            context.mark(np.array([-5.5]))
        if self.how == "draft":
            return document.with_draft(None)
        return BadStep(self.how.removeprefix("step "))


GESTURES = {
    "raises": "division by zero",
    "exits": "SystemExit: a script of old",
    "text": "returned str",
    "mesh": "changed the mesh without a step",
    "region": "not ascending vertex ids",
    "level": "level is 7",
    "preview": "previews str",
    "mark": "",
    "draft": "draft is none",
}


class Asked(Tool):
    """A tool that does wrong when it is asked `what`, else answers as any tool."""

    id = "asked"
    title = "Asked"
    repeats = False

    def __init__(self, what: str, how: str) -> None:
        self.what, self.how = what, how

    def _do(self, what: str, answer: Any) -> Any:
        if what != self.what:
            return answer
        if self.how == "raises":
            raise KeyError(f"no {what}")
        if self.how == "exits":
            sys.exit(f"no {what}")
        if self.how == "array":
            return np.zeros(3)  # neither true nor false
        begun = time.monotonic()
        while unending(begun):
            pass
        return answer

    def hint(self, document: Any) -> str:
        return self._do("hint", "Draw")

    def claims(self, document: Any) -> bool:
        return self._do("claims", False)

    def available(self, document: Any) -> bool:
        return self._do("available", True)

    def circle(self, options: Any) -> float | None:
        return self._do("circle", None)


QUESTIONS = ("hint", "claims", "available", "circle")
