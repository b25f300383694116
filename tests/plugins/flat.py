"""A plate that lies flat under the eye, and hands on it: tools without a window."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.path import Path as Outline

from engine import Decomposition, Document, Mesh, View
from plugins.api import Hit, Pointer, Tool
from plugins.lasso import Lasso
from plugins.source import SourceTool
from plugins.target import TargetTool

SIZE = (400.0, 400.0)


def plate(n: int = 21) -> Mesh:
    """A square of 100 mm in the x, y plane, looked at from above."""
    x, y = np.meshgrid(np.linspace(-50, 50, n), np.linspace(-50, 50, n))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]), faces)


def from_above(scale: float = 1 / 100) -> View:
    """An orthographic view along -z: 2 px a millimetre, the origin in the middle."""
    return View(np.diag([scale, scale, -scale, 1.0]), SIZE)


def px(x: float, y: float) -> tuple[float, float]:
    """Pixel of a point of the plate, mm."""
    return (200 + 2 * x, 200 - 2 * y)


@dataclass
class FlatContext:
    """What a tool sees of a plate that lies flat under the eye."""

    document: Document
    options: Any = None
    decomposition: Decomposition | None = None
    view: View = field(default_factory=from_above)
    drawn: list[tuple[np.ndarray, str]] = field(default_factory=list)
    marked: list[np.ndarray] = field(default_factory=list)
    previews: list[Document] = field(default_factory=list)
    sayings: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)

    @property
    def shown(self) -> Mesh:
        return self.document.mesh

    def pick(self, x: float, y: float) -> Hit | None:
        away = np.linalg.norm(self.view.project(self.shown.vertices) - (x, y), axis=1)
        vertex = int(away.argmin())
        if away[vertex] > 10.0:
            return None  # the plate ends here
        return Hit(0, vertex, self.shown.vertices[vertex])

    def towards(self, side: str) -> np.ndarray:
        sides = {"right": (1, 0, 0), "front": (0, -1, 0), "top": (0, 0, 1)}
        return np.array(sides[side], dtype=np.float64)

    def vertices_inside(self, polygon: np.ndarray, through: bool = False) -> np.ndarray:
        seen = self.view.project(self.shown.vertices)
        return np.flatnonzero(Outline(polygon).contains_points(seen))

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> np.ndarray:
        seen = self.view.project(self.shown.vertices)
        return np.flatnonzero(np.linalg.norm(seen - (x, y), axis=1) <= radius)

    def faces_at(self, points: np.ndarray) -> np.ndarray:
        corners = self.view.project(self.shown.vertices)[self.shown.faces]
        found = []
        for at in points:
            e = [corners[:, (k + 1) % 3] - corners[:, k] for k in range(3)]
            r = [at - corners[:, k] for k in range(3)]
            side = [a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] for a, b in zip(e, r, strict=True)]
            inside = np.all([q >= 0 for q in side], axis=0) | np.all([q <= 0 for q in side], axis=0)
            found += [*np.flatnonzero(inside)[:1], -1][:1]
        return np.array(found, dtype=np.int64)

    def faces_under(self, path: np.ndarray) -> np.ndarray:
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        t = np.linspace(0, 1, int(length) + 2)
        s = np.concatenate([[0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()]) / length
        ids = self.faces_at(np.column_stack([np.interp(t, s, path[:, k]) for k in range(2)]))
        ids = ids[ids >= 0]
        return ids[np.append(True, np.diff(ids) != 0)] if len(ids) else ids

    def draw(self, path: np.ndarray, role: str, closed: bool = False) -> None:
        self.drawn.append((path, role))

    def mark(self, ids: np.ndarray) -> None:
        self.marked.append(ids)

    def preview(self, change: Document) -> None:
        self.previews.append(change)

    def say(self, text: str) -> None:
        self.sayings.append(text)

    def notice(self, text: str) -> None:
        self.notices.append(text)


def do(tool: Tool, context: FlatContext, path: Iterable[tuple[float, float]], **keys: Any) -> Any:
    """Press, move and release along a path; return what the tool returned."""
    context.options = tool.Options() if context.options is None else context.options
    points = list(path)
    gesture = tool.gesture(context, Pointer("press", *points[0], **keys))
    try:
        next(gesture)
        for point in points[1:]:
            gesture.send(Pointer("move", *point, **keys))
        gesture.send(Pointer("release", *points[-1], **keys))
    except StopIteration as end:
        return end.value
    raise AssertionError("the gesture did not end with the release")


def around(x: float, y: float, r: float) -> list[tuple[float, float]]:
    return [px(x + r * np.cos(t), y + r * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 40)]


def line(a: tuple[float, float], b: tuple[float, float], n: int = 20) -> list[tuple[float, float]]:
    return [px(*(np.array(a) + t * (np.array(b) - a))) for t in np.linspace(0, 1, n)]


def chosen(context: FlatContext) -> FlatContext:
    context.document = do(Lasso(), context, around(0, 0, 31))
    context.options = None
    return context


def sketched(context: FlatContext) -> FlatContext:
    chosen(context)
    context.document = do(SourceTool(), context, line((-15, 0), (15, 0)))
    context.options = None
    context.document = do(TargetTool(), context, line((-15, 10), (15, 10)))
    return context
