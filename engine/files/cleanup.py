"""Cleanup: each repair runs only where its defect was counted, and is measured afterwards.

pymeshlab's filters do it where they keep every position to the last bit and the vertices' order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.arrays import F64, I64
from engine.files.defects import (
    Defects,
    areas,
    collapsed_faces,
    doubled_faces,
    fans_apart,
    find_defects,
    joined,
    repeated_faces,
)
from engine.files.report import AREA_WARNING, FACE_WARNING, Change, counted

Pair = tuple[F64, I64]


@dataclass(frozen=True)
class Cleaned:
    """What cleanup made: vertices, faces, what each step did, and what to be warned about."""

    vertices: F64
    faces: I64
    repairs: tuple[Change, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Repair:
    """One step: how many defects of its kind there are, what mends them, and how to say so.

    `keeps_area` says that the step must leave the surface's area as it is.
    """

    what: str
    found: Callable[[Defects], int]
    mend: Callable[[F64, I64], Pair]
    words: str
    keeps_area: bool = True


def clean_up(v: F64, f: I64, tick: Callable[[float], None]) -> Cleaned:
    """Mend what can be mended without guessing; holes are never closed.

    A mesh without defects comes out as the same arrays.
    """
    start = (v, f)
    repairs: list[Change] = []
    warnings: list[str] = []
    defects = find_defects(v, f)
    for i, repair in enumerate(_REPAIRS):
        found = repair.found(defects)
        if not found:
            continue
        tick(i / len(_REPAIRS))
        mended = _attempt(repair, v, f)
        if mended is None:
            continue
        if not _is_sound(mended) or (repair.keeps_area and not _same_area((v, f), mended)):
            kind = repair.what.replace("_", " ")
            warnings.append(f"One repair ({kind}) would have spoilt the surface and was left out.")
            continue
        after = find_defects(*mended)
        left = repair.found(after)
        if left >= found:
            continue
        repairs.append(_change(repair, found - left, (v, f), mended))
        (v, f), defects = mended, after
    warnings += _remaining(defects)
    warnings += _large_changes(start, (v, f))
    return Cleaned(v, f, tuple(repairs), tuple(warnings))


def _is_sound(mended: Pair) -> bool:
    v, f = mended
    if len(f) == 0 or not np.isfinite(v).all():
        return False
    return int(f.min()) >= 0 and int(f.max()) < len(v)


def _same_area(before: Pair, after: Pair) -> bool:
    """Return whether the surface's area is the same to a millionth."""
    with np.errstate(over="ignore", invalid="ignore"):
        was, now = float(areas(*before).sum()), float(areas(*after).sum())
    return abs(now - was) <= 1e-6 * was


def _attempt(repair: Repair, v: F64, f: I64) -> Pair | None:
    import pymeshlab

    try:
        return repair.mend(v, f)
    except pymeshlab.PyMeshLabException:
        # A filter that declines (a surface with one side cannot be oriented) leaves the mesh as is.
        return None


def _change(repair: Repair, mended: int, before: Pair, after: Pair) -> Change:
    vertices = abs(len(after[0]) - len(before[0]))
    faces = abs(len(after[1]) - len(before[1]))
    if repair.what in ("orientation", "inside_out", "zero_area"):
        faces = _turned(before[1], after[1])
    words = repair.words.format(
        vertices=counted(vertices, "vertex"),
        faces=counted(faces, "face"),
        mended_vertices=counted(mended, "vertex"),
        mended_edges=counted(mended, "edge"),
        mended_faces=counted(mended, "face"),
    )
    return Change(repair.what, words, vertices, faces)


def _turned(before: I64, after: I64) -> int:
    """Return how many faces name their vertices otherwise than before, wherever each begins."""
    if len(before) != len(after):
        return abs(len(before) - len(after))
    begun = [np.roll(before, shift, axis=1) for shift in range(3)]
    same = np.logical_or.reduce([(after == b).all(axis=1) for b in begun])
    return int((~same).sum())


def _filtered(v: F64, f: I64, *filters: tuple[str, dict[str, Any]]) -> Pair:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(v, f.astype(np.int32)))
    for name, options in filters:
        meshes.apply_filter(name, **options)
    mesh = meshes.current_mesh()
    mesh.compact()
    return np.array(mesh.vertex_matrix()), mesh.face_matrix().astype(np.int64)


def _join(v: F64, f: I64) -> Pair:
    faces = joined(v, f)
    left = np.zeros(len(v), dtype=bool)
    left[f] = True
    left[faces] = False
    return v[~left], (np.cumsum(~left) - 1)[faces]


def _drop_collapsed(v: F64, f: I64) -> Pair:
    # pymeshlab's filter for null faces takes thin ones too and opens holes.
    return v, f[~collapsed_faces(f)]


def _drop_repeated(v: F64, f: I64) -> Pair:
    if repeated_faces(f).any():
        v, f = _filtered(v, f, ("meshing_remove_duplicate_faces", {}))
    return v, f[~doubled_faces(v, f)]


def _drop_unreferenced(v: F64, f: I64) -> Pair:
    return _filtered(v, f, ("meshing_remove_unreferenced_vertices", {}))


def _flip_flat(v: F64, f: I64) -> Pair:
    # Flipping keeps the surface whole; the threshold spares what is merely thin.
    options = {"method": "Edge Flip", "threshold": 1e6, "repeat": True}
    return _filtered(v, f, ("meshing_remove_t_vertices", options))


def _take_apart(v: F64, f: I64) -> Pair:
    # Not by pymeshlab's filters: they change last bits of positions, and the vertices' order.
    parted, copied = fans_apart(f, len(v))
    return np.vstack([v, v[copied]]), parted


def _orient(v: F64, f: I64) -> Pair:
    return _filtered(v, f, ("meshing_re_orient_faces_coherently", {}))


def _turn_out(v: F64, f: I64) -> Pair:
    return _filtered(v, f, ("meshing_invert_face_orientation", {"forceflip": True}))


_REPAIRS = (
    Repair(
        "duplicate_faces",
        lambda d: d.repeated,
        _drop_repeated,
        "{faces} that repeated another one removed.",
        keeps_area=False,
    ),
    Repair(
        "duplicate_vertices",
        lambda d: d.joinable,
        _join,
        "{vertices} at the very place of another joined to it.",
    ),
    Repair(
        "collapsed_faces",
        lambda d: d.collapsed,
        _drop_collapsed,
        "{faces} that named a vertex twice removed.",
    ),
    Repair(
        "unreferenced_vertices",
        lambda d: d.unreferenced,
        _drop_unreferenced,
        "{vertices} that no face uses removed.",
    ),
    Repair(
        "zero_area",
        lambda d: d.zero_area,
        _flip_flat,
        "{mended_faces} without area mended by flipping an edge.",
    ),
    Repair(
        "nonmanifold_edges",
        lambda d: d.nonmanifold_edges,
        _take_apart,
        "{mended_edges} with more than two faces taken apart; {vertices} added.",
    ),
    Repair(
        "nonmanifold_vertices",
        lambda d: d.nonmanifold_vertices,
        _take_apart,
        "{mended_vertices} where surfaces touch in a point taken apart; {vertices} added.",
    ),
    Repair(
        "orientation",
        lambda d: d.flipped,
        _orient,
        "{faces} turned so that neighbours look the same way.",
    ),
    Repair(
        "inside_out",
        lambda d: int(d.inverted),
        _turn_out,
        "The whole surface was inside out and was turned.",
    ),
)


def _remaining(defects: Defects) -> list[str]:
    left = (
        (defects.zero_area, "face", "without area could not be mended"),
        (defects.nonmanifold_edges, "edge", "with more than two faces could not be taken apart"),
        (defects.nonmanifold_vertices, "vertex", "where surfaces touch in a point could not be "
         "taken apart"),
        (defects.flipped, "edge", "between faces that look in opposite directions could not be "
         "mended: the surface may have only one side"),
    )  # fmt: skip
    return [f"{counted(k, noun)} {what}." for k, noun, what in left if k]


def _large_changes(before: Pair, after: Pair) -> list[str]:
    lost = abs(len(before[1]) - len(after[1])) / len(before[1])
    with np.errstate(over="ignore", invalid="ignore"):
        size = float(areas(*before).sum())
        moved = abs(float(areas(*after).sum()) - size) / size if size > 0 else 0.0
    found = []
    if lost > FACE_WARNING:
        found.append(f"Cleanup changed the number of faces by {lost:.1%}: look before you go on.")
    if moved > AREA_WARNING:
        found.append(f"Cleanup changed the surface's area by {moved:.1%}: look before you go on.")
    return found
