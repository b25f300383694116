"""The fold at the rim: original, base shape and an edit, on fixed regions of every mesh there is.

python -m bench.rim FOLDER [--regions 4] [--rim smooth]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import breadth_first_order, connected_components

from engine import Decomposition, EngineError, Mesh, SketchEdit, Stroke, decompose, look_at
from engine import open_file as opened
from engine.arrays import F64, I64
from engine.measure import dihedral_angles
from resources import sample_path

SAMPLES = ("vase", "tank", "drill", "plate")
LEAST, MOST = 150, 8000
# How far the middle of the source curve is pulled out, as a share of the region's size.
PULL = 0.08


def meshes(folder: Path) -> Iterator[tuple[str, Mesh]]:
    """Yield the meshes of a folder and the samples."""
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        yield path.stem, opened(path, clean=False).mesh
    for name in SAMPLES:
        yield name, opened(sample_path(name), clean=False).mesh


def regions(mesh: Mesh, count: int, seed: int) -> Iterator[I64]:
    """Yield connected pieces of balls, 6 to 20 % of the model's size in radius."""
    rng = np.random.default_rng(seed)
    x = mesh.vertices
    size = float(np.linalg.norm(x.max(axis=0) - x.min(axis=0)))
    adjacency = mesh.topology.adjacency
    found = 0
    for _ in range(40 * count):
        centre = int(rng.integers(mesh.n))
        radius = size * rng.uniform(0.06, 0.2)
        near = np.flatnonzero(np.linalg.norm(x - x[centre], axis=1) < radius)
        label = connected_components(adjacency[near][:, near], directed=False)[1]
        roi = near[label == label[np.searchsorted(near, centre)]]
        if LEAST <= len(roi) <= MOST:
            yield roi
            found += 1
        if found == count:
            return


def rim_folds(mesh: Mesh, vertices: F64, roi: I64) -> F64:
    """Return the 50th and 95th percentile and the largest fold over the region's border, degrees.

    Counted are the edges of the faces that have corners on both sides.
    """
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    corners = inside[mesh.faces]
    border = np.logical_and(corners.any(axis=1), ~corners.all(axis=1))
    angles = dihedral_angles(mesh.with_vertices(vertices), border)
    return np.degrees(np.percentile(angles, [50, 95, 100]))


def pulled(parts: Decomposition) -> SketchEdit:
    """Return an edit that pulls a line across the region outwards, as seen from the side."""
    mesh, roi = parts.region.mesh, parts.roi
    x = mesh.vertices[roi]
    adjacency = mesh.topology.adjacency[roi][:, roi]
    middle = int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1)))
    first = int(breadth_first_order(adjacency, middle, directed=False)[0][-1])
    order, before = breadth_first_order(adjacency, first, directed=False)
    way = [int(order[-1])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    ids = roi[np.array(way[len(way) // 4 : len(way) - len(way) // 4])]
    along = mesh.vertices[ids[-1]] - mesh.vertices[ids[0]]
    out = mesh.vertex_normals[roi].mean(axis=0)
    out -= out @ along / (along @ along) * along
    out /= np.linalg.norm(out)
    side = np.cross(out, along / np.linalg.norm(along))
    azimuth = np.degrees(np.arctan2(side[0], -side[1]))
    elevation = np.degrees(np.arcsin(np.clip(side[2], -1, 1)))
    size = parts.region.scale
    view = look_at(mesh.vertices[ids].mean(axis=0), 4 * size, azimuth, elevation, (1000, 1000))
    shown = parts.base[np.searchsorted(roi, ids)]
    bend = np.sin(np.linspace(0, np.pi, len(ids)))
    target = view.project(shown + PULL * size * np.outer(bend, out))
    return SketchEdit(roi, 0.0, (Stroke(ids, view, target),))


def main() -> None:
    """Run the measure and print one line a region and the sum."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--regions", type=int, default=4)
    parser.add_argument("--rim", choices=("smooth", "paper"), default="smooth")
    parser.add_argument("--save", type=Path, help="write the figures here, as .npy")
    given = parser.parse_args()
    rows = []
    print("| region | vertices | original p50 p95 max | base | edited |\n|---|---|---|---|---|")
    for name, mesh in meshes(given.folder):
        for i, roi in enumerate(regions(mesh, given.regions, len(name))):
            try:
                parts = decompose(mesh, roi, modes=0, rim=given.rim)
                step = pulled(parts)
                edited = step.prepare(mesh, None, parts).solve(step.strokes).vertices
            except EngineError as error:
                print(f"| {name} {i} | {len(roi)} | {error} | | |")
                continue
            shape = mesh.vertices.copy()
            shape[parts.roi] = parts.base
            folds = [rim_folds(mesh, v, parts.roi) for v in (mesh.vertices, shape, edited)]
            rows.append(np.concatenate(folds))
            told = " | ".join(" ".join(f"{a:.1f}" for a in part) for part in folds)
            print(f"| {name} {i} | {parts.m} | {told} |", flush=True)
    found = np.array(rows)
    if given.save:
        np.save(given.save, found)
    ratio = found[:, [4, 7]] / found[:, [1, 1]]
    print(f"\n{len(found)} regions; p95 against the original's: ", end="")
    for what, column in zip(("base", "edited"), ratio.T, strict=True):
        p50, p90, most = np.percentile(column, [50, 90, 100])
        over = int(np.count_nonzero(column > 1.02))
        print(f"{what} {p50:.2f} (90 %: {p90:.2f}, most {most:.2f}, above 1.02: {over}); ", end="")
    print()


if __name__ == "__main__":
    main()
