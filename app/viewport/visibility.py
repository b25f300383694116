"""Which vertices are seen, from an image of the triangles that are seen.

Most are settled by the few triangles seen around their pixel. Along silhouettes and folds, where
that image is too coarse, the triangles that could lie in front are looked up and tested exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree

from engine.arrays import B1, F64, I64

_AROUND = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)]
_HAIR = 1e-9


def facing(screen: F64, faces: I64) -> B1:
    """Return which triangles are seen from outside, (f,); y runs down on screen."""
    a, b, c = (screen[faces[:, k], :2] for k in range(3))
    return np.asarray(_cross(b - a, c - a) < 0)


def touched(faces: I64, chosen: B1, n: int) -> B1:
    """Return which of `n` vertices belong to a chosen triangle."""
    mask = np.zeros(n, dtype=bool)
    mask[faces[chosen].ravel()] = True
    return mask


def deepest(ids: NDArray[np.int32], screen: F64, faces: I64) -> NDArray[np.float32]:
    """Return a depth behind which nothing is seen in the nine pixels around each, (h, w).

    The deepest corner of the triangles seen there, and twice their spread more; infinite beside the
    background.
    """
    seen = np.zeros(len(faces), dtype=bool)
    seen[ids[ids >= 0]] = True
    used = np.flatnonzero(seen)
    depth = screen[faces[used], 2].astype(np.float32)
    most, least = depth.max(axis=1), depth.min(axis=1)
    # The last entry is what the id -1 of the background finds.
    limit = np.full(len(faces) + 1, np.inf, dtype=np.float32)
    limit[used] = most + 2 * (most - least) + 1e-6
    return np.asarray(maximum_filter(limit[ids], size=3, mode="nearest"))


def visible(
    candidates: I64,
    ids: NDArray[np.int32],
    screen: F64,
    faces: I64,
    front: B1,
    back: B1,
    limit: NDArray[np.float32],
) -> B1:
    """Return which of `candidates` are seen, (k,).

    Parameters
    ----------
    candidates : (k,) vertex ids, all within the picture.
    ids : (h, w) the triangle seen at each pixel, -1 for none, row 0 on top.
    screen : (n, 3) pixels x, y and depth of all vertices.
    front, back : (n,) whether a vertex has a triangle seen from outside, or from inside.
    limit : (h, w) what `deepest` gives.
    """
    result, unsure = glance(candidates, ids, screen, faces, front, back, limit)
    result[unsure] = ~hidden(candidates[unsure], screen, faces)
    return result


def glance(
    candidates: I64,
    ids: NDArray[np.int32],
    screen: F64,
    faces: I64,
    front: B1,
    back: B1,
    limit: NDArray[np.float32],
) -> tuple[B1, I64]:
    """Return which of `candidates` are seen, (k,), as far as the image tells; and where it cannot.

    The parameters are those of `visible`; the second are places in `candidates`, which are seen
    unless they are `hidden`.
    """
    place = screen[candidates]
    px, py = place[:, 0].astype(np.int64), place[:, 1].astype(np.int64)
    middle = ids[py, px]
    result = (middle >= 0) & (faces[middle] == candidates[:, None]).any(axis=1)
    asked = np.flatnonzero(~result & (place[:, 2] <= limit[py, px] + _HAIR))
    result[asked], unsure = _looked_at(candidates[asked], ids, screen, faces, front, back)
    return result, asked[unsure]


def _looked_at(
    candidates: I64, ids: NDArray[np.int32], screen: F64, faces: I64, front: B1, back: B1
) -> tuple[B1, I64]:
    """Decide about candidates by the triangles seen in the nine pixels around each."""
    place = screen[candidates]
    count = len(candidates)
    covered, own, plain, sky = (np.zeros(count, dtype=bool) for _ in range(4))
    nearest, farthest = np.full(count, np.inf), np.full(count, -np.inf)
    slack = np.zeros(count)
    for centre, there, seen in _seen_around(place, ids):
        sky |= ~there
        k = np.flatnonzero(there)
        corners = faces[seen[k]]
        is_own = (corners == candidates[k, None]).any(axis=1)
        depth, spread, slope = _plane(place[k], screen, corners)
        covered[k] |= ~is_own & _contains(place[k], screen, corners)
        own[k] |= is_own
        nearest[k] = np.minimum(nearest[k], depth)
        farthest[k] = np.maximum(farthest[k], depth)
        slack[k] = np.maximum(slack[k], spread + 0.5 * slope)
        if centre:
            outside = facing(screen, corners)
            turned = np.where(outside, front[candidates[k]], back[candidates[k]])
            plain[k] = (place[k, 2] <= depth + spread + 0.3 * slope + _HAIR) & turned
    fold = sky | (farthest - nearest > 2 * slack)
    result = plain & ~covered
    unsure = np.flatnonzero(
        fold & ~covered & (sky | own | (place[:, 2] <= farthest + 2 * slack + _HAIR))
    )
    return result, unsure


def _seen_around(
    place: F64, ids: NDArray[np.int32]
) -> Iterator[tuple[bool, B1, NDArray[np.int32]]]:
    """Yield for each of nine pixels: is it the middle one, where is something seen, and what."""
    height, width = ids.shape
    px, py = place[:, 0].astype(np.int64), place[:, 1].astype(np.int64)
    for dx, dy in _AROUND:
        seen = ids[np.clip(py + dy, 0, height - 1), np.clip(px + dx, 0, width - 1)]
        yield dx == 0 and dy == 0, seen >= 0, seen


def _cross(u: F64, v: F64) -> F64:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _plane(place: F64, screen: F64, corners: I64) -> tuple[F64, F64, F64]:
    """Return the depth of triangles' planes at `place`, their spread of depth, and slope per pixel.

    Outside its triangle a steep plane runs away; it is held within a few times its corners' spread.
    """
    a, b, c = (screen[corners[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    upright = np.where(np.abs(normal[:, 2]) > 1e-12, normal[:, 2], 1e-12)
    depth = a[:, 2] - ((place[:, :2] - a[:, :2]) * normal[:, :2]).sum(axis=1) / upright
    most = np.maximum(np.maximum(a[:, 2], b[:, 2]), c[:, 2])
    least = np.minimum(np.minimum(a[:, 2], b[:, 2]), c[:, 2])
    spread = most - least
    slope = np.minimum(np.hypot(normal[:, 0], normal[:, 1]) / np.abs(upright), 8 * spread)
    return np.clip(depth, least - 4 * spread, most + 4 * spread), spread, slope


def _contains(place: F64, screen: F64, corners: I64) -> B1:
    """Whether each triangle covers `place` on screen and lies in front of it."""
    a, b, c = (screen[corners[:, k]] for k in range(3))
    q = place[:, :2]
    weights = np.stack(
        [
            _cross(c[:, :2] - b[:, :2], q - b[:, :2]),
            _cross(a[:, :2] - c[:, :2], q - c[:, :2]),
            _cross(b[:, :2] - a[:, :2], q - a[:, :2]),
        ],
        axis=1,
    )
    total = weights.sum(axis=1)
    share = weights / np.where(total == 0, 1e-30, total)[:, None]
    depth = share[:, 0] * a[:, 2] + share[:, 1] * b[:, 2] + share[:, 2] * c[:, 2]
    inside = (share > -_HAIR).all(axis=1) & (total != 0)
    return np.asarray(inside & (depth < place[:, 2] - _HAIR))


def hidden(vertices: I64, screen: F64, faces: I64) -> B1:
    """Whether each vertex lies behind a triangle that is not its own.

    Only triangles up to a usual size are looked up; much larger ones are in the image.
    """
    covered = np.zeros(len(vertices), dtype=bool)
    if len(vertices) == 0:
        return covered
    place = screen[vertices]
    reach = _reach(screen, faces)
    cell = 2 * reach  # a triangle's first corner is within this of every point of it
    low = place[:, :2].min(axis=0) - cell
    size = np.ceil((place[:, :2].max(axis=0) + cell - low) / cell).astype(int) + 2
    near = np.zeros(size[::-1], dtype=bool)
    at = ((place[:, :2] - low) / cell).astype(int)
    for dx, dy in _AROUND:
        near[np.clip(at[:, 1] + dy, 0, size[1] - 1), np.clip(at[:, 0] + dx, 0, size[0] - 1)] = True
    first = (screen[faces[:, 0], :2] - low) / cell
    inside = np.flatnonzero((first >= 0).all(axis=1) & (first < size).all(axis=1))
    there = first[inside].astype(int)
    some = inside[near[there[:, 1], there[:, 0]]]
    if len(some) == 0:
        return covered
    corners = screen[faces[some]]
    pairs = cKDTree(place[:, :2]).sparse_distance_matrix(
        cKDTree(corners[..., :2].mean(axis=1)), reach, output_type="coo_matrix"
    )
    row, column = pairs.row, pairs.col
    # Most pairs go by their boxes: the rest is tested exactly.
    least, most = corners.min(axis=1)[column], corners[..., :2].max(axis=1)[column]
    at = place[row]
    could = (least <= at).all(axis=1) & (most >= at[:, :2]).all(axis=1)
    row, face = row[could], faces[some[column[could]]]
    foreign = ~(face == vertices[row, None]).any(axis=1)
    row, face = row[foreign], face[foreign]
    covered[row[_contains(place[row], screen, face)]] = True
    return covered


def _reach(screen: F64, faces: I64) -> float:
    """Return how far (px) the middle of a triangle usually is from its corners, at the most."""
    corners = screen[faces[:: max(1, len(faces) // 5000)], :2]
    far = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    far = far[np.isfinite(far)]
    return float(np.clip(1.3 * np.percentile(far, 98), 0.5, 24.0)) if len(far) else 2.0
