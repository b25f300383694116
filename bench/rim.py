"""The fold at the rim: original, base shape and an edit, on fixed regions of every mesh there is.

python -m bench.rim FOLDER [--regions 4] [--rim smooth]

Two measures. The fold over the border beside the original's is what is seen, and grows with the
form where a pull bends it. What an edit adds to the folds over the border, beside what it adds over
the rings inside, tells a crease from a bend: a smooth change fades out towards the rim. It cannot
where the curve is pulled further than about half its way from the rim; these pulls are counted
apart, as steep.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from engine import Decomposition, EngineError, Mesh, SketchEdit, Stroke, decompose, look_at
from engine import open_file as opened
from engine.arrays import F64, I64
from engine.measure import dihedral_angles, face_pairs
from resources import sample_path

SAMPLES = ("vase", "tank", "drill", "plate")
LEAST, MOST = 150, 8000
# How far the middle of the source curve is pulled out, as a share of the region's size.
PULL = 0.08
RINGS = 3
# Anchors that go further than this share of their way from the rim leave no room to fade out.
STEEP = 0.5


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


def added_folds(mesh: Mesh, vertices: F64, roi: I64) -> F64:
    """Return what a change adds to the folds over the border and the rings inside, degrees.

    Returns
    -------
    (1 + RINGS,) 95th percentiles of |signed angle after - before|, the border first.
    """
    depth = np.zeros(mesh.n, dtype=np.int64)
    inside = np.zeros(mesh.n, dtype=bool)
    inside[roi] = True
    for _ in range(RINGS + 1):
        depth[inside] += 1
        inside &= ~(mesh.topology.adjacency @ (~inside).astype(np.float64) > 0)
    corners = depth[mesh.faces]
    outside = corners.max(axis=1) == 0
    ring = np.where(outside, -1, corners.min(axis=1))
    first, second = face_pairs(mesh)
    at = np.minimum(ring[first], ring[second])
    # An edge between a face of the border and one outside belongs to the border.
    at = np.where((at < 0) & (np.maximum(ring[first], ring[second]) == 0), 0, at)
    added = np.abs(
        signed_folds(mesh.with_vertices(vertices), first, second)
        - signed_folds(mesh, first, second)
    )
    # A fold that passes 180 degrees comes back from the other side.
    added = np.degrees(np.minimum(added, 2 * np.pi - added))
    rings = [added[at == k] for k in range(1 + RINGS)]
    return np.array([np.percentile(a, 95) if len(a) else 0.0 for a in rings])


def signed_folds(mesh: Mesh, first: I64, second: I64) -> F64:
    """Return the angle between two faces of each edge, radians, positive where it is hollow."""
    a, b = mesh.face_normals[first], mesh.face_normals[second]
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    hollow = ((middle[second] - middle[first]) * a).sum(axis=1) >= 0
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
    return np.where(hollow, angle, -angle)


def steepness(parts: Decomposition, step: SketchEdit, level: F64) -> float:
    """Return how far an anchor goes, at most, as a share of its way from the rim."""
    anchors = np.searchsorted(parts.roi, step.strokes[0].anchors)
    start = parts.base[anchors]
    way = np.linalg.norm(level[parts.roi][anchors] - start, axis=1)
    held = parts.region.mesh.vertices[parts.region.rim]
    return float((way / cKDTree(held).query(start)[0]).max())


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
    fades = []
    print(
        "| region | vertices | original p50 p95 max | base | edited | added at rim, rings | way |\n"
        "|---|---|---|---|---|---|---|"
    )
    for name, mesh in meshes(given.folder):
        for i, roi in enumerate(regions(mesh, given.regions, len(name))):
            try:
                parts = decompose(mesh, roi, modes=0, rim=given.rim)
                step = pulled(parts)
                result = step.prepare(mesh, None, parts).solve(step.strokes)
                edited = result.vertices
            except EngineError as error:
                print(f"| {name} {i} | {len(roi)} | {error} | | | | |")
                continue
            shape = mesh.vertices.copy()
            shape[parts.roi] = parts.base
            folds = [rim_folds(mesh, v, parts.roi) for v in (mesh.vertices, shape, edited)]
            rows.append(np.concatenate(folds))
            added = added_folds(mesh, edited, parts.roi)
            way = steepness(parts, step, result.level_vertices)
            fades.append((added[0] / max(added[1:].max(), 1e-9), way))
            told = " | ".join(" ".join(f"{a:.1f}" for a in part) for part in (*folds, added))
            print(f"| {name} {i} | {parts.m} | {told} | {way:.2f} |", flush=True)
    found = np.array(rows)
    if given.save:
        np.save(given.save, found)
    ratio = found[:, [4, 7]] / found[:, [1, 1]]
    print(f"\n{len(found)} regions; p95 against the original's: ", end="")
    for what, column in zip(("base", "edited"), ratio.T, strict=True):
        p50, p90, most = np.percentile(column, [50, 90, 100])
        over = int(np.count_nonzero(column > 1.02))
        print(f"{what} {p50:.2f} (90 %: {p90:.2f}, most {most:.2f}, above 1.02: {over}); ", end="")
    fade, way = np.array(fades).T
    steep = way > STEEP
    print(f"\nadded at the rim beside the rings inside: {np.median(fade):.2f}; above 1: ", end="")
    print(f"{int((fade[~steep] > 1).sum())} of {int((~steep).sum())} pulls, ", end="")
    print(f"{int((fade[steep] > 1).sum())} of {int(steep.sum())} steep ones")


if __name__ == "__main__":
    main()
