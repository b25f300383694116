"""Handle: take hold of a patch of the region and move, turn or scale it; the rest follows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from plugins.api import (
    F64,
    I64,
    REGION_FIRST,
    Context,
    DataStep,
    Document,
    EngineError,
    Gesture,
    Mesh,
    Pointer,
    RecipeError,
    Region,
    Run,
    Tool,
    View,
    connected_to,
    drag_patches,
    mirrored_region,
    option,
    reflection,
    shrunk,
)

FREE_RINGS = 3  # between the patch and the rim, for a smooth passage
SLIP = 3.0  # px: a shorter drag is a click
PIXELS_A_TURN = 480.0  # a drag so long turns once around
PIXELS_A_DOUBLING = 140.0  # a drag so long to the right or up doubles the size

Motion = Literal["move", "turn", "twist", "scale"]
Method = Literal["smooth", "rigid"]
Plane = tuple[float, ...]
NO_TWIN: I64 = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class HandleStep(DataStep):
    """Moves `patch` by a similarity; the rest of `roi` follows, its rim stays.

    `matrix` holds the 16 numbers of x' = M (x, 1), row by row, in mesh units. `level` is the level
    of detail that is bent: what is finer rides along, turned with the form. `twin` is the patch on
    the other side of the plane `mirror` (a, b, c, d); it goes by the mirror image of the motion.
    """

    roi: I64
    patch: I64
    matrix: tuple[float, ...]
    level: float = field(default=0.0, metadata={"min": 0.0, "max": 1.0})
    method: Method = "smooth"
    twin: I64 = field(default_factory=NO_TWIN.copy)
    mirror: Plane = ()
    kind: ClassVar[str] = "handle"
    label: ClassVar[str] = "Handle"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the mesh with the patch moved."""
        motions: list[tuple[I64, F64]] = [(self.patch, np.array(self.matrix))]
        if len(self.twin):
            if len(self.mirror) != 4 or not any(self.mirror[:3]):
                raise RecipeError("The handle's plane must be four numbers a, b, c, d.")
            R = reflection(self.mirror)
            motions.append((self.twin, R @ motions[0][1].reshape(4, 4) @ R))
        return drag_patches(mesh, self.roi, motions, self.level, self.method, run)


@dataclass(frozen=True)
class HandleOptions:
    """How the handle takes hold, and what follows."""

    radius: float = option(
        36.0,
        "Radius",
        "How much of the form is taken in hand",
        low=4.0,
        high=400.0,
        step=2.0,
        unit="px",
        decimals=0,
    )
    motion: Motion = option("move", "Drag to", "Shift turns and Ctrl scales, whatever is set here")
    method: Method = option(
        "smooth", "Rest", "Smooth flows softly into the handle; rigid keeps shapes in larger turns"
    )


class Handle(Tool):
    """Moves, turns and scales a patch of the region."""

    id = "handle"
    title = "Handle"
    tip = "Press on the region and drag: a patch of it moves, the rest follows"
    icon = "mdi6.cursor-move"
    shortcut = "H"
    label = "Handle"
    order = 60
    sized = "radius"
    Options = HandleOptions

    def available(self, document: Document) -> bool:
        """A handle is a part of a region."""
        return document.draft.roi is not None

    def hint(self, document: Document) -> str:
        """Say what a drag does."""
        if document.draft.roi is None:
            return REGION_FIRST
        return "Drag a patch of the region to move it; Shift turns it, Ctrl scales it"

    def circle(self, options: HandleOptions) -> float | None:
        """Show what the handle would take."""
        return options.radius

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Take hold at the press and follow the hand; the form follows live."""
        options, document = context.options, context.document
        patch, grasp = taken(context, pointer)
        motion = motion_of(pointer, options.motion)
        roi, level, plane = document.draft.roi, document.draft.level, document.draft.options.mirror
        assert roi is not None
        twin, normal = NO_TWIN, None
        if plane:
            patch, twin, normal = mirrored(document.mesh, roi, patch, plane)
        middle = document.mesh.vertices[patch].mean(axis=0)
        start = np.array(pointer.xy)
        step: HandleStep | None = None
        while pointer.kind != "release":
            pointer = yield
            drag = np.array(pointer.xy) - start
            if np.linalg.norm(drag) < SLIP and step is None:
                continue
            matrix = similarity(context.view, motion, drag, grasp, middle, normal)
            numbers = tuple(matrix.ravel().tolist())
            step = HandleStep(roi, patch, numbers, level, options.method, twin, plane)
            context.preview(step)
        return step


def motion_of(pointer: Pointer, otherwise: Motion) -> Motion:
    """Return what a drag does that begins like this."""
    if pointer.shift:
        return "turn"
    return "scale" if pointer.ctrl else otherwise


def taken(context: Context, pointer: Pointer) -> tuple[I64, F64]:
    """Return the patch under the pointer and the point taken hold of, (3,).

    The patch is the connected piece of the region that is seen inside the circle, with some rings
    left free to the region's rim and to open borders, which stay.

    Raises
    ------
    EngineError
        There is no region there, or too little of it.
    """
    mesh, roi = context.document.mesh, context.document.draft.roi
    hit = context.pick(pointer.x, pointer.y)
    if roi is None or hit is None or hit.vertex not in roi:
        raise EngineError("The handle is not on the region. Press on the coloured part.")
    near = context.vertices_near(pointer.x, pointer.y, context.options.radius)
    patch = connected_to(
        mesh.topology,
        np.intersect1d(np.union1d(near, [hit.vertex]), movable(mesh, roi)),
        hit.vertex,
    )
    if len(patch) == 0:
        raise EngineError(
            "The handle is too near to the region's rim, which stays. Press further inside, or "
            "choose a larger region."
        )
    return patch, hit.point


def movable(mesh: Mesh, roi: I64) -> I64:
    """Return the part of a region that a handle may take: some rings off its rim, which stays."""
    return shrunk(mesh.topology, Region(mesh, roi).roi, FREE_RINGS)


def mirrored(mesh: Mesh, roi: I64, patch: I64, plane: Plane) -> tuple[I64, I64, F64 | None]:
    """Return the patch, its twin beyond a plane of symmetry, and the normal it must keep to.

    A patch that meets its own mirror image goes as one with it, and only as far as the plane stays
    its own: then there is no twin, and the plane's unit normal (3,) is returned.
    """
    both = np.intersect1d(mirrored_region(mesh, patch, plane), movable(mesh, roi))
    own = connected_to(mesh.topology, both, int(patch[0]))
    normal = np.array(plane[:3]) / np.linalg.norm(plane[:3])
    side = mesh.vertices[own] @ np.array(plane[:3]) - plane[3]
    on_plane = bool(side.min() <= 0 <= side.max())
    return own, np.setdiff1d(both, own), normal if on_plane else None


def similarity(
    view: View, motion: Motion, drag: F64, grasp: F64, middle: F64, normal: F64 | None = None
) -> F64:
    """Return the motion of the patch as a matrix (4, 4) that a drag (2,) px asks for.

    "move" keeps the grasp below the pointer, in the plane through it parallel to the picture. The
    others leave the middle where it is: "turn" rolls the patch like a ball under the hand, "twist"
    turns it about the line of sight, "scale" grows it to the right and up.

    Parameters
    ----------
    normal : (3,) of a plane of symmetry that the patch lies on, or None. It moves within that plane
        then, and turns about its normal.
    """
    M = np.eye(4)
    if motion == "move":
        way = in_picture_plane(view, grasp, drag)
        M[:3, 3] = way if normal is None else way - (way @ normal) * normal
        return M
    if motion == "scale":
        linear = 2.0 ** ((drag[0] - drag[1]) / PIXELS_A_DOUBLING) * np.eye(3)
    else:
        axis, angle = turning(view, motion, drag)
        if normal is not None:
            axis, angle = normal, angle * float(axis @ normal)
        linear = rotation(axis, angle)
    M[:3, :3] = linear
    M[:3, 3] = middle - linear @ middle
    return M


def turning(view: View, motion: Motion, drag: F64) -> tuple[F64, float]:
    """Return the unit axis (3,) and the angle in radians that a drag (2,) px turns by."""
    right, down, away = picture_axes(view)
    if motion == "twist":
        return away, 2 * np.pi * float(drag[0]) / PIXELS_A_TURN
    length = float(np.linalg.norm(drag))
    along = (drag[0] * right + drag[1] * down) / max(length, 1e-12)
    return np.cross(-away, along), 2 * np.pi * length / PIXELS_A_TURN


def in_picture_plane(view: View, point: F64, drag: F64) -> F64:
    """Return the move (3,) of `point` parallel to the picture that is seen as `drag` (2,) px."""
    u, v = view.project(point)[0] + drag
    P = view.pixel_matrix
    away = picture_axes(view)[2]
    rows = np.stack([(P[0] - u * P[2])[:3], (P[1] - v * P[2])[:3], away])
    sides = np.array([u * P[2, 3] - P[0, 3], v * P[2, 3] - P[1, 3], away @ point])
    size = np.linalg.norm(rows, axis=1)
    return np.asarray(np.linalg.solve(rows / size[:, None], sides / size) - point)


def picture_axes(view: View) -> tuple[F64, F64, F64]:
    """Return unit vectors (3,) to the right, down, and away from the eye."""
    P = view.pixel_matrix
    width, height = view.size
    right = (P[0] - width / 2 * P[2])[:3]
    down = (P[1] - height / 2 * P[2])[:3]
    right = right / np.linalg.norm(right)
    down = down / np.linalg.norm(down)
    return right, down, np.cross(right, down)


def rotation(axis: F64, angle: float) -> F64:
    """Return the rotation (3, 3) about a unit axis by an angle in radians (Rodrigues)."""
    x, y, z = axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across)
