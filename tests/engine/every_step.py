"""A mesh and one of each kind of step on it: closed, mirrored and several strokes, and the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine import Document, EditOptions, History, Mesh, SketchEdit, Source, Step, Stroke
from engine.arrays import F64, I64
from engine.view import look_at
from plugins.equaliser import EqualiserStep
from plugins.handle import HandleStep
from plugins.inflate import InflateStep
from plugins.morph import morph_between
from plugins.remesh import RemeshStep
from plugins.smooth import SmoothStep
from plugins.symmetrise import SymmetriseStep
from tests.engine.shapes import sphere

ACROSS_X = (1.0, 0.0, 0.0, 0.0)


def bumpy(level: int) -> Mesh:
    """A ball of 50 mm with bumps that no plane mirrors."""
    ball = sphere(level)
    x = ball.vertices
    bumps = np.sin(7 * x[:, :1] + 0.3) * np.sin(6 * x[:, 1:2]) * np.sin(5 * x[:, 2:] + 0.1)
    return ball.with_vertices(50 * x * (1 + 0.05 * bumps))


def above(mesh: Mesh) -> I64:
    """The ids of a cap that looks up."""
    return np.flatnonzero(mesh.vertices[:, 2] > 18.0)


def stroke(mesh: Mesh, x: F64, y: F64, up: F64, closed: bool = False) -> Stroke:
    """A stroke through the vertices nearest to points on the cap, seen from above, moved `up`."""
    camera = look_at([0, 0, 0], 200, 0, 90, (800, 600))
    wanted = np.column_stack([x, y, np.sqrt(np.maximum(0, 2500 - x**2 - y**2))])
    away = np.linalg.norm(mesh.vertices[None] - wanted[:, None], axis=2)
    anchors = np.array(list(dict.fromkeys(away.argmin(axis=1).tolist())))
    target = Source(anchors, camera).still(mesh).target
    along = np.linspace(0, 1, len(anchors))
    target = target + np.outer(np.interp(along, np.linspace(0, 1, len(up)), up), [0.3, 1.0])
    return Stroke(anchors, camera, target, closed=closed)


def sketches(mesh: Mesh) -> dict[str, SketchEdit]:
    """Edits by strokes: one that is closed, several at once, one that is mirrored and polished."""
    roi = above(mesh)
    t = np.linspace(-14.0, 14.0, 24)
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = stroke(mesh, 16 * np.cos(turn), 16 * np.sin(turn), np.array([9.0, 14.0, 9.0]), True)
    bow = np.array([0.0, 18.0, 0.0])
    left = stroke(mesh, np.full_like(t, -12.0), t, bow)
    right = stroke(mesh, np.full_like(t, 13.0), t, -bow)
    mirrored = EditOptions(mirror=ACROSS_X, polish=3, amount=0.8, depth_hold=0.3)
    return {
        "closed": SketchEdit(roi, 0.4, (ring,), EditOptions()),
        "several strokes": SketchEdit(roi, 0.0, (left, right), EditOptions(rim="paper")),
        "mirrored": SketchEdit(roi, 1.0, (left,), mirrored),
    }


def every_step(mesh: Mesh) -> dict[str, Step]:
    """One step of each kind that fits `mesh`."""
    roi = above(mesh)
    patch = np.flatnonzero(np.linalg.norm(mesh.vertices - [0, 0, 50], axis=1) < 12)
    motion = np.eye(4)
    motion[:3, 3] = 4.0, -2.0, 9.0
    other = sketches(mesh)["several strokes"].apply(mesh)
    rigid = HandleStep(roi, patch, tuple(motion.ravel().tolist()), 0.3, "rigid")
    return {
        **sketches(mesh),
        "handle": replace(rigid, method="smooth"),
        "rigid handle": rigid,
        "morph": replace(morph_between(mesh, other), form=0.7, detail=0.2),
        "symmetrise": SymmetriseStep(roi, ACROSS_X, fade=0.5),
        "smooth": SmoothStep(roi, 0.2, 0.6),
        "inflate": InflateStep(roi, 2.0, 0.5),
        "equaliser": EqualiserStep(roi, (90.0, 45.0), (1.0, 1.8, 0.2)),
        "remesh": RemeshStep(roi, 6.0),
    }


def one_history(mesh: Mesh) -> History:
    """A document with a branch for each kind of step, and a sketch after the remeshing."""
    history = History(Document.open(mesh, "bumpy"))
    for name, step in every_step(mesh).items():
        history.go(0)
        history.add(history.current.with_step(step, step.apply(history.current.mesh)), name)
    history.rename(history.current_id, "finer")
    last = sketches(history.current.mesh)["closed"]
    history.add(history.current.with_step(last, last.apply(history.current.mesh)), "after it")
    return history
