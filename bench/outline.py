"""How near the rendered outline comes to a target drawn for it, on every mesh there is.

python -m bench.outline FOLDER [--regions 2] [--level 0]

A curve on the outline of the form is pulled out by a share of its length. Measured, along the
normals of the stroke as it was drawn, is the outermost outline of all faces of the region, at the
level and with the details on. The outline of a mesh is a polygon: how far one through the targets
of the anchors is off the curve is told beside, as the bound.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bench.rim import meshes
from engine import (
    EngineError,
    Mesh,
    SketchEdit,
    Stroke,
    View,
    decompose,
    look_at,
    resample_target,
    silhouette_chain,
)
from engine.arrays import F64, I64
from engine.contour import Contour, reach_beyond
from engine.sketch import target_curve, tidy_stroke

PULLS = (0.05, 0.15, 0.35)
RADIUS = (0.12, 0.25)
MOST = 9000
SPAN = np.radians(65.0)
MARGIN = 0.08  # of the curve, at either end: there the form goes on as it was


def outline_path(view: View, contour: Contour, vertices: F64, inner: F64, out: F64) -> F64 | None:
    """Return the outermost outline as seen about a point (2,) px, from its middle `out` (2,)."""
    lines = contour.lines(view, vertices)
    angle = np.linspace(-SPAN, SPAN, 240) + np.arctan2(out[1], out[0])
    rays = np.column_stack([np.cos(angle), np.sin(angle)])
    r = reach_beyond(lines, np.tile(inner, (len(rays), 1)), rays, np.full(len(rays), 2000.0))
    good = np.isfinite(r) & (r > 5)
    good[1:] &= np.abs(np.diff(r, prepend=r[0])[1:]) < 0.15 * r[1:]
    breaks = np.flatnonzero(~good)
    middle = len(r) // 2
    low = breaks[breaks < middle].max(initial=-1) + 1
    high = breaks[breaks >= middle].min(initial=len(r))
    if high - low < 40:
        return None
    part = slice(low, high)
    path = inner + r[part, None] * rays[part]
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    return tidy_stroke(path, 1.0, 0.03 * length)


def off_curve(contour: Contour, view: View, vertices: F64, drawn: F64, out: F64) -> F64:
    """Return how far the outermost outline is off a drawn curve (p, 2) px, along its normals."""
    along = np.gradient(drawn, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    if (normals @ out).sum() < 0:
        normals = -normals
    off = reach_beyond(contour.lines(view, vertices), drawn, normals, np.full(len(drawn), 40.0))
    edge = max(3, round(MARGIN * len(drawn)))
    return off[edge:-edge]


def bound(drawn: F64, target: F64) -> float:
    """Return how far a polygon through targets (c, 2) is off a curve (p, 2), 95th percentile, px.

    Finer than that the mesh cannot be: its edges are straight.
    """
    steps = np.linspace(0, len(target) - 1, 40 * len(target))
    dense = np.column_stack([np.interp(steps, np.arange(len(target)), t) for t in target.T])
    return float(np.percentile(cKDTree(dense).query(drawn)[0], 95))


def region(mesh: Mesh, centre: int, radius: float) -> I64:
    """Return the connected piece of a ball about a vertex."""
    x = mesh.vertices
    near = np.flatnonzero(np.linalg.norm(x - x[centre], axis=1) < radius)
    label = connected_components(mesh.topology.adjacency[near][:, near], directed=False)[1]
    return np.asarray(near[label == label[np.searchsorted(near, centre)]])


def main() -> None:
    """Run the measure and print one line a pull and the sum."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--regions", type=int, default=2)
    parser.add_argument("--level", type=float, default=0.0)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    print(
        "| mesh | vertices | edge px | bound | pull px | rms p95 max | details p95 | told | s |"
        "\n|---|---|---|---|---|---|---|---|---|"
    )
    found = []
    for name, mesh in meshes(given.folder):
        if given.only and not any(o in name for o in given.only.split(",")):
            continue
        x = mesh.vertices
        size = float(np.linalg.norm(np.ptp(x, axis=0)))
        rng = np.random.default_rng(len(name))
        for case in range(given.regions):
            view = look_at(
                (x.min(axis=0) + x.max(axis=0)) / 2,
                1.3 * size,
                rng.uniform(0, 360),
                rng.uniform(-30, 30),
                (1000, 1000),
            )
            theta = rng.uniform(0, 2 * np.pi)
            out = np.array([np.cos(theta), np.sin(theta)])
            roi = region(mesh, int(np.argmax(view.project(x) @ out)), size * rng.uniform(*RADIUS))
            if not 150 <= len(roi) <= MOST:
                continue
            try:
                parts = decompose(mesh, roi, modes=0)
                shown = x.copy()
                shown[parts.roi] = parts.base
                seen = view.project(shown[parts.roi])
                inner = seen.mean(axis=0) - out * 0.1 * float(np.ptp(seen @ out))
                contour = Contour.of(mesh, parts.roi)
                path = outline_path(view, contour, shown, inner, out)
                if path is None:
                    continue
                model = mesh.with_vertices(shown)
                chain = silhouette_chain(model, path, view, parts.roi)
                if chain is None or len(chain) < 6:
                    continue
                ends = view.project(shown[chain])
                first, last = (int(np.argmin(((path - e) ** 2).sum(1))) for e in ends[[0, -1]])
                path = path[min(first, last) : max(first, last) + 1]
                length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
                edge = float(np.median(np.linalg.norm(np.diff(ends, axis=0), axis=1)))
            except EngineError as error:
                print(f"| {name} {case} | {len(roi)} | {error} |")
                continue
            share = np.linspace(-0.5, 0.5, len(path))
            for pull in PULLS:
                drawn = path + pull * length * np.outer(np.cos(np.pi * share) ** 2, out)
                target = resample_target(shown[chain], drawn, view)
                step = SketchEdit(roi, 0.0, (Stroke(chain, view, target, outline=True),))
                try:
                    edit = step.prepare(mesh, None, parts)
                    start = time.thread_time()
                    result = edit.solve(step.strokes)
                    spent = time.thread_time() - start
                except EngineError as error:
                    print(f"| {name} {case} | {len(roi)} | {pull} {error} |")
                    continue
                off = off_curve(contour, view, result.level_vertices, drawn, out)
                on = off_curve(contour, view, result.vertices, drawn, out)
                known = np.abs(np.where(np.isfinite(off), off, 40.0))
                rms = float(np.sqrt((known**2).mean()))
                p95, most = np.percentile(known, [95, 100])
                with_details = np.nanpercentile(np.abs(on), 95) if np.isfinite(on).any() else np.nan
                limit = bound(drawn, target_curve(shown[chain], target, view))
                found.append((rms, p95, most, limit, result.target_error_px, spent))
                print(
                    f"| {name} {case} | {len(roi)}, {len(chain)} | {edge:.1f} | {limit:.2f} | "
                    f"{pull * length:.0f} | {rms:.2f} {p95:.2f} {most:.2f} | {with_details:.2f} | "
                    f"{result.target_error_px:.2f} | {spent:.2f} |",
                    flush=True,
                )
    rows = np.array(found)
    met = rows[:, 1] <= 0.5 + rows[:, 3]
    print(
        f"\n{len(rows)} pulls; rms median {np.median(rows[:, 0]):.2f}, "
        f"90 % {np.percentile(rows[:, 0], 90):.2f}; p95 median {np.median(rows[:, 1]):.2f}, "
        f"90 % {np.percentile(rows[:, 1], 90):.2f}; within half a pixel and the bound: "
        f"{int(met.sum())}; {rows[:, 5].sum():.1f} s"
    )


if __name__ == "__main__":
    main()
