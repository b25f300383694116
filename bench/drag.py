"""One sketched edit of a region: prepared once, then its target moved again and again."""

from __future__ import annotations

import time

import numpy as np

from bench.measures import Figures, peak_memory
from bench.surfaces import sheet
from engine import EditOptions, Mesh, Run, SketchEdit, Stroke, View, decompose
from engine.arrays import F64, I64

UPDATES = 20


def camera() -> View:
    """Perspective view from above onto the sheet of 100 mm."""
    far, size, tangent = 300.0, (1200.0, 1000.0), np.tan(np.radians(15))
    world = np.eye(4)
    world[:3, 3] = -50.0, -50.0, -far
    lens = np.array(
        [
            [size[1] / size[0] / tangent, 0, 0, 0],
            [0, 1 / tangent, 0, 0],
            [0, 0, -1.02, -0.2 * far],
            [0, 0, -1, 0],
        ]
    )
    tilt = np.eye(4)
    c, s = np.cos(0.9), np.sin(0.9)
    tilt[1:3, 1:3] = [[c, s], [-s, c]]
    back = np.eye(4)
    back[2, 3] = -far
    world[2, 3] = 0.0
    return View(lens @ back @ tilt @ world, size)


def anchors(mesh: Mesh, roi: I64, count: int = 40) -> I64:
    """Return vertices of the region along a line across its middle."""
    x = np.linspace(32, 68, count)
    line = np.column_stack([x, np.full(count, 50.0)])
    p = mesh.vertices[roi, :2]
    nearest = [int(np.argmin(((p - at) ** 2).sum(axis=1))) for at in line]
    return roi[np.array(list(dict.fromkeys(nearest)))]


def pulls(count: int) -> list[F64]:
    """Return how far the anchors are drawn upwards in each update, (count,) px."""
    bend = np.sin(np.linspace(0, np.pi, count))
    return [(20 + 3 * i) * bend for i in range(UPDATES)]


def edit(m: int) -> Figures:
    """Time to prepare an edit at the base shape, and of an update down to the details."""
    mesh, roi = sheet(m)
    view, ids = camera(), anchors(mesh, roi)
    parts = decompose(mesh, roi, modes=0)
    shown = mesh.vertices.copy()
    shown[parts.roi] = parts.base
    here = view.project(shown[ids])
    strokes = [Stroke(ids, view, here - np.outer(pull, [0.0, 1.0])) for pull in pulls(len(ids))]
    step = SketchEdit(roi, 0.0, (strokes[0],), EditOptions())
    begun, begun_cpu = time.perf_counter(), time.process_time()
    prepared = step.prepare(mesh, Run(), parts)
    at = {"prepare": time.perf_counter() - begun, "cpu": time.process_time() - begun_cpu}
    took, took_cpu = [], []
    for stroke in strokes:
        begun, begun_cpu = time.perf_counter(), time.process_time()
        result = prepared.solve((stroke,))
        took.append(time.perf_counter() - begun)
        took_cpu.append(time.process_time() - begun_cpu)
    at |= {"update": float(np.median(took)), "update cpu": float(np.median(took_cpu))}
    at |= {"error px": result.target_error_px, "memory GiB": peak_memory()}
    return at


def moved_to(mesh: Mesh, ids: I64, pull: F64) -> F64:
    """Return where the anchors are pulled in space for a peer that takes positions, (c, 3)."""
    return mesh.vertices[ids] + np.outer(pull / 10, [0.0, 0.0, 1.0])


def igl_arap(m: int) -> Figures:
    """libigl's ARAP with all outside the region and the anchors held, as it is usually called."""
    import igl

    mesh, roi = sheet(m)
    ids = anchors(mesh, roi)
    outside = np.setdiff1d(np.arange(mesh.n), roi)
    held = np.concatenate([outside, ids]).astype(np.int32)
    data = igl.ARAPData()
    data.max_iter = 10
    begun = time.perf_counter()
    igl.arap_precomputation(mesh.vertices, mesh.faces, 3, held, data)
    at = {"prepare": time.perf_counter() - begun}
    took, took_cpu, shape = [], [], mesh.vertices
    for pull in pulls(len(ids))[:5]:
        goal = np.concatenate([mesh.vertices[outside], moved_to(mesh, ids, pull)])
        begun, begun_cpu = time.perf_counter(), time.process_time()
        shape = igl.arap_solve(goal, data, shape)
        took.append(time.perf_counter() - begun)
        took_cpu.append(time.process_time() - begun_cpu)
    return at | {"update": float(np.median(took)), "update cpu": float(np.median(took_cpu))}
