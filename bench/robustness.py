"""Random regions on every mesh there is: each comes back right, or is refused with a reason.

python -m bench.robustness FOLDER [--regions 2] [--seeds 4]
"""

from __future__ import annotations

import argparse
import collections
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench import broken
from engine import EngineError, Mesh, decompose, open_file
from engine.arrays import I64
from engine.base import BENT

LARGEST_REGION = 800


def random_region(mesh: Mesh, rng: np.random.Generator, most: int = LARGEST_REGION) -> I64:
    """Return a random connected set of 1 to `most` vertices, grown ring by ring."""
    size = int(rng.integers(1, min(most, mesh.n) + 1))
    start = int(rng.choice(np.flatnonzero(mesh.topology.used_vertices)))
    inside = np.zeros(mesh.n, dtype=bool)
    inside[start] = True
    adjacency = mesh.topology.adjacency
    while (count := int(inside.sum())) < size:
        ring = np.flatnonzero((adjacency @ inside.astype(float) > 0) & ~inside)
        if len(ring) == 0:
            break
        inside[rng.permutation(ring)[: size - count]] = True
    return np.flatnonzero(inside)


def wrong_with(mesh: Mesh, roi: I64) -> str:
    """Return "" if the region's decomposition is right, else what is wrong with it.

    Raises
    ------
    EngineError
        The region was refused.
    """
    parts = decompose(mesh, roi)
    scale = parts.region.scale
    k = parts.m // 3
    back = parts.reconstruct(parts.surface(k), parts.high(k))
    gram = parts.modes.T @ (parts.areas[:, None] * parts.modes)
    for name, array in (("base", parts.base), ("modes", parts.modes), ("surface", back)):
        if not np.isfinite(array).all():
            return f"{name} is not finite"
    if np.abs(gram - np.eye(parts.k)).max() > 1e-8:
        return "modes are not orthonormal"
    if (parts.eigenvalues <= 0).any() or (np.diff(parts.eigenvalues) < 0).any():
        return "eigenvalues are not positive and ascending"
    if np.linalg.norm(parts.base - parts.original, axis=1).max() > scale:
        return "the base is further than a diagonal away"
    if np.abs(back - parts.original).max() > 1e-6 * scale:
        return f"details do not give the original back ({np.abs(back - parts.original).max()})"
    if parts.surface(parts.m) is not parts.original:
        return "level 1 is not the original"
    before = bending(parts.region.x, parts.region)
    base = parts.region.x.copy()
    base[: parts.m] = (parts.base - parts.region.centre) / scale
    if bending(base, parts.region) > BENT * before + 1e-12:
        return "the base bends more than the original"
    return ""


def bending(x: np.ndarray, region: object) -> float:
    """Return sum_i M_i |delta_i|^2 over the vertices of roi and rim that have a closed ring."""
    m, near = region.m, region.m + len(region.rim)
    delta = region.laplacian.stiffness[:near] @ x
    weight = np.where(region.rim_open, 0.0, 1 / region.laplacian.areas[:near])
    weight[:m] = np.where(region.rim_open[:m], 0.0, weight[:m])
    return float(np.sum(weight[:, None] * delta**2))


def meshes(folder: Path, seeds: int) -> Iterator[tuple[str, Mesh]]:
    """Yield every mesh of a folder that can be opened, as it is, and generated broken ones."""
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        try:
            yield path.name, open_file(path, clean=False).mesh
        except EngineError:
            continue
    for name, make in broken.KINDS.items():
        for seed in range(seeds):
            yield f"{name} {seed}", make(seed)


def main() -> None:
    """Run the measure and print what it found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--regions", type=int, default=6)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--verbose", action="store_true", help="say every refusal")
    given = parser.parse_args()
    counts: collections.Counter[str] = collections.Counter()
    reasons: collections.Counter[str] = collections.Counter()
    slowest = 0.0
    for name, mesh in meshes(given.folder, given.seeds):
        rng = np.random.default_rng(len(name))
        for _ in range(given.regions):
            roi = random_region(mesh, rng)
            begun = time.perf_counter()
            try:
                wrong = wrong_with(mesh, roi)
                counts["wrong" if wrong else "right"] += 1
                if wrong:
                    print(f"{name}, {len(roi)} vertices from {roi[0]}: {wrong}")
            except EngineError as error:
                counts["refused"] += 1
                reasons[str(error)] += 1
                if given.verbose:
                    print(f"{name}, {len(roi)} vertices from {roi[0]}: {error}")
            slowest = max(slowest, time.perf_counter() - begun)
    print(f"{sum(counts.values())} solves: {dict(counts)}; slowest {slowest:.2f} s")
    for reason, times in reasons.most_common():
        print(f"  {times} times: {reason}")


if __name__ == "__main__":
    main()
