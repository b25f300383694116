"""Symmetrise: one side becomes the mirror image of the other; the region fades out at its rim."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from plugins.api import (
    F64,
    I64,
    Context,
    DataStep,
    Document,
    EngineError,
    Gesture,
    Mesh,
    Nearby,
    Pointer,
    Result,
    Run,
    Side,
    Tool,
    cotangent_stiffness,
    factorise,
    option,
    reflected,
    symmetry_plane,
    taken_apart,
    vertex_areas,
)

# Lengths over which a vertex and its neighbours move together, in shares of the diagonal, round by
# round: without it the vertices before a bump would crowd on its near side.
TOGETHER = (0.05, 0.03, 0.02, 0.01)
NO_REGION = np.zeros(0, dtype=np.int64)

# How the plane that fits best is found: points looked at, rounds, and the share that must fit.
SAMPLES = 4000
FITS = 12
DIVIDES = 0.1  # cosine between a plane's normal and the side to keep: below, neither half is meant
ANY_SIDE = np.array([1.0, 0.6, 0.3])  # along no plane that a form is likely to be symmetric across
TRIMMED = 0.6


@dataclass(frozen=True, eq=False)
class SymmetriseStep(DataStep):
    """Moves the vertices on one side of a plane onto the mirror image of the other side.

    `plane` is a, b, c, d with a x + b y + c z = d, or empty for the plane that fits best; the kept
    side is the one that the direction `keep` points to. An empty `roi` means the whole mesh.
    `fade` is how far the change fades in from the rim of a region, 0 to 1. Faces stay as they are,
    so the mirror image is exact up to the size of the triangles.
    """

    roi: I64
    plane: tuple[float, ...] = ()
    keep: tuple[float, ...] = (1.0, 0.0, 0.0)
    fade: float = field(default=0.5, metadata={"min": 0.0, "max": 1.0})
    kind: ClassVar[str] = "symmetrise"
    label: ClassVar[str] = "Symmetrise"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the symmetric mesh."""
        run = run or Run()
        plane = self._plane(mesh, run)
        moving = other_side(mesh, plane)
        inside = moving[np.isin(moving, self.roi)] if len(self.roi) else moving
        if len(inside) == 0:
            raise EngineError(
                "The region lies on the side that is kept. Keep the other side, or choose a region "
                "that reaches across the plane."
            )
        key = ("mirror image", mesh.digest, plane)
        image = run.memo.get(key, lambda: mirror_image(mesh, plane, moving, run))
        share = rim_share(mesh, self.roi, self.fade, run) if len(self.roi) else np.ones(mesh.n)
        vertices = mesh.vertices.copy()
        vertices[inside] += share[inside, None] * (image[inside] - vertices[inside])
        return mesh.with_vertices(vertices)

    def _plane(self, mesh: Mesh, run: Run) -> tuple[float, ...]:
        """Return the plane with a unit normal that points to the kept side."""
        if len(self.plane) not in (0, 4) or (self.plane and not any(self.plane[:3])):
            raise EngineError("A plane is four numbers a, b, c, d with a normal that is not zero.")
        key = ("symmetry plane", mesh.digest)
        found = np.array(self.plane or run.memo.get(key, lambda: fitting_plane(mesh, run)))
        unit = found / np.linalg.norm(found[:3])
        towards = np.array(self.keep)
        if towards.shape != (3,) or not np.linalg.norm(towards) > 0:
            raise EngineError("The side to keep is a direction: three numbers that are not all 0.")
        reach = float(unit[:3] @ towards) / float(np.linalg.norm(towards))
        if abs(reach) < DIVIDES:
            raise EngineError(
                "The plane that fits best does not divide the form this way. Keep another side, "
                "or take the plane through the middle."
            )
        return tuple((unit if reach > 0 else -unit).tolist())


def other_side(mesh: Mesh, plane: tuple[float, ...]) -> I64:
    """Return the ids of the vertices on the side that the plane's normal points away from."""
    height = mesh.vertices @ np.array(plane[:3]) - plane[3]
    return np.flatnonzero((height < -1e-9 * mesh.diagonal) & mesh.topology.used_vertices)


def fitting_plane(mesh: Mesh, run: Run | None = None) -> tuple[float, ...]:
    """Return the plane across which most of the mesh is symmetric, a, b, c, d.

    An edit on one side pulls the middle of the whole mesh along; so the plane is fitted again to
    the share of the mesh that it fits best, by Gauss-Newton steps on the distances
    r = (x* - q) . n_q from the mirror images x* = x - 2 (n . x - d) n to the tangent planes at
    their closest vertices q. It turns about the middle: far from it a turn would be a shift.
    """
    run = run or Run()
    plane = np.array(symmetry_plane(mesh, run)[0])
    ids = np.flatnonzero(mesh.topology.used_vertices)
    middle = mesh.vertices[ids].mean(axis=0)
    everywhere, normals = mesh.vertices[ids] - middle, mesh.vertex_normals[ids]
    tree, x = cKDTree(everywhere), everywhere[:: max(1, len(ids) // SAMPLES)]
    plane[3] -= plane[:3] @ middle
    for i in range(FITS):
        run.tick(i / FITS, "Fitting the plane of symmetry")
        n, d = plane[:3], plane[3]
        image = reflected(x, tuple(plane.tolist()))
        away, nearest = tree.query(image)
        fits = away <= np.quantile(away, TRIMMED)
        p, q, facing = x[fits], everywhere[nearest[fits]], normals[nearest[fits]]
        r = ((image[fits] - q) * facing).sum(axis=1)
        along = facing @ n
        height = p @ n - d
        across = np.linalg.svd(n[None, :])[2][1:]  # two unit vectors in the plane
        by_turn = -2 * (along[:, None] * (p @ across.T) + height[:, None] * (facing @ across.T))
        J = np.column_stack([by_turn, 2 * along * mesh.diagonal])
        change = np.linalg.lstsq(J, -r, rcond=1e-3)[0]
        normal = n + across.T @ change[:2]
        plane = np.append(normal, d + change[2] * mesh.diagonal) / np.linalg.norm(normal)
    plane[3] += plane[:3] @ middle
    return tuple(plane.tolist())


def mirror_image(mesh: Mesh, plane: tuple[float, ...], moving: I64, run: Run) -> F64:
    """Return positions (n, 3) with `moving` on the mirror image of the other side.

    In a few rounds every vertex goes to the closest point of the image, first together with all its
    neighbours, then more and more by itself: u solves (M + t K) u = M d for the ways d.
    """
    normal, offset = np.array(plane[:3]), plane[3]
    kept = np.ones(mesh.n, dtype=bool)
    kept[moving] = False
    if not kept.any():
        raise EngineError("Nothing lies on the side that is kept. Keep the other side.")
    source = Nearby(mesh, np.asarray(kept[mesh.faces].any(axis=1)))
    M = sp.diags_array(np.maximum(vertex_areas(mesh), 1e-12 * mesh.diagonal**2))
    K = cotangent_stiffness(mesh)
    x, rounds = mesh.vertices.copy(), len(TOGETHER) + 1

    def way(at: F64, i: int) -> F64:
        normals = mesh.with_vertices(at).vertex_normals[moving]
        normals = normals - 2 * np.outer(normals @ normal, normal)
        images = reflected(at[moving], plane)

        def tick(share: float) -> None:
            run.tick((i + share) / rounds, "Finding the mirror image")

        found = source.to(images, normals, tick=tick).points
        # What a triangle across the plane holds beyond it has no image on this side.
        beyond = np.minimum(found @ normal - offset, 0.0)
        d = np.zeros_like(at)
        d[moving] = reflected(found - beyond[:, None] * normal, plane) - at[moving]
        return d

    for i, length in enumerate(TOGETHER):
        d = way(x, i)
        run.tick((i + 1) / rounds, "Finding the mirror image")
        factor = factorise(sp.csr_array(M + (length * mesh.diagonal) ** 2 * K))
        run.tick((i + 1) / rounds, "Finding the mirror image")
        x[moving] += factor.solve(M @ d)[moving]
    return x + way(x, len(TOGETHER))


def rim_share(mesh: Mesh, roi: I64, fade: float, run: Run) -> F64:
    """Return the share (n,) of the change that each vertex takes: 0 at the rim, 1 inside.

    It is the height of a membrane under pressure over the region, cut off and eased.
    """
    parts = taken_apart(mesh, roi, 0.0, run)
    height = parts.factor.solve(parts.areas[:, None])[:, 0]
    rise = np.clip(height / height.max() / (0.05 + 0.9 * fade), 0.0, 1.0)
    share = np.zeros(mesh.n)
    share[parts.roi] = rise**2 * (3 - 2 * rise)
    return share


@dataclass(frozen=True)
class SymmetriseOptions:
    """What the person sets."""

    keep: Literal["edited", Side] = option(
        "edited",
        "Keep",
        "The side that is mirrored to the other: where you edited most, or as the view cube says",
    )
    plane: Literal["best_fit", "middle"] = option(
        "best_fit", "Plane", "The plane that fits best, or the one through the middle of the model"
    )
    fade: float = option(
        0.5,
        "Fade",
        "How far the change fades in from the region's rim",
        low=0.0,
        high=1.0,
        step=0.05,
    )


class Symmetrise(Tool):
    """Makes the form, or the region, symmetric."""

    id = "symmetrise"
    title = "Symmetrise"
    tip = "Make one side the mirror image of the other"
    icon = "mdi6.reflect-horizontal"
    label = "Symmetrise"
    order = 140
    live = True
    Options = SymmetriseOptions

    def hint(self, document: Document) -> str:
        """Say what will change, and how to keep it."""
        what = "the model" if document.draft.roi is None else "the region"
        return f"Choose the side to keep; {{edit.apply}} makes {what} symmetric"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Take no strokes."""
        yield from ()
        return None

    def enter(self, context: Context) -> Result:
        """Return the step for the options as they are."""
        options, document = context.options, context.document
        plane: tuple[float, ...] = ()
        middle = document.original.bounds.mean(axis=0)
        keep = edited_side(document) if options.keep == "edited" else context.towards(options.keep)
        if options.plane == "middle":
            normal = np.eye(3)[np.abs(keep).argmax()]
            # The middle of the model as it was opened: an edit on one side pulls its own along.
            plane = (*normal.tolist(), float(normal @ middle))
        roi = NO_REGION if document.draft.roi is None else document.draft.roi
        return SymmetriseStep(roi, plane, tuple(keep.tolist()), options.fade)


def edited_side(document: Document) -> F64:
    """Return the direction (3,) from the middle of the model to where it was edited most."""
    before, after = document.original, document.mesh
    if before.faces is not after.faces:
        return ANY_SIDE
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    if not moved.any():
        return ANY_SIDE
    where = (moved @ before.vertices) / moved.sum() - before.bounds.mean(axis=0)
    return np.asarray(where if np.linalg.norm(where) > 1e-3 * before.diagonal else ANY_SIDE)
