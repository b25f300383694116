"""Handle: take hold of a patch of the region and move, turn or scale it; the rest follows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from plugins.api import (
    F64,
    I64,
    Context,
    DataStep,
    Document,
    EngineError,
    Gesture,
    Mesh,
    Pointer,
    Region,
    Run,
    Tool,
    View,
    connected_to,
    drag_patch,
    shrunk,
)

FREE_RINGS = 3  # between the patch and the rim, for a smooth passage
SLIP = 3.0  # px: a shorter drag is a click
PIXELS_A_TURN = 480.0  # a drag so long turns once around
PIXELS_A_DOUBLING = 140.0  # a drag so long to the right or up doubles the size

Motion = Literal["move", "turn", "twist", "scale"]
Method = Literal["smooth", "rigid"]


@dataclass(frozen=True, eq=False)
class HandleStep(DataStep):
    """Moves `patch` by a similarity; the rest of `roi` follows, its rim stays.

    `matrix` holds the 16 numbers of x' = M (x, 1), row by row, in mesh units. `level` is the level
    of detail that is bent: what is finer rides along, turned with the form.
    """

    roi: I64
    patch: I64
    matrix: tuple[float, ...]
    level: float = field(default=0.0, metadata={"min": 0.0, "max": 1.0})
    method: Method = "smooth"
    kind: ClassVar[str] = "handle"
    label: ClassVar[str] = "Handle"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the mesh with the patch moved."""
        return drag_patch(mesh, self.roi, self.patch, self.matrix, self.level, self.method, run)


@dataclass(frozen=True)
class HandleOptions:
    """How the handle takes hold, and what follows."""

    radius: float = field(
        default=36.0,
        metadata={
            "label": "Radius",
            "tip": "How much of the form is taken in hand",
            "min": 4.0,
            "max": 400.0,
            "step": 2.0,
            "unit": "px",
            "decimals": 0,
        },
    )
    motion: Motion = field(
        default="move",
        metadata={"label": "Drag to", "tip": "Shift turns and Ctrl scales, whatever is set here"},
    )
    method: Method = field(
        default="smooth",
        metadata={
            "label": "Rest",
            "tip": "Smooth flows softly into the handle; rigid keeps shapes in larger turns",
        },
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
    Options = HandleOptions

    def available(self, document: Document) -> bool:
        """A handle is a part of a region."""
        return document.draft.roi is not None

    def hint(self, document: Document) -> str:
        """Say what a drag does."""
        if document.draft.roi is None:
            return "Choose a region first: press L and circle the part you want to change"
        return "Drag a patch of the region to move it; Shift turns it, Ctrl scales it"

    def circle(self, options: HandleOptions) -> float | None:
        """Show what the handle would take."""
        return options.radius

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Take hold at the press and follow the hand; the form follows live."""
        options, document = context.options, context.document
        patch, grasp = taken(context, pointer)
        motion = motion_of(pointer, options.motion)
        middle = document.mesh.vertices[patch].mean(axis=0)
        start = np.array(pointer.xy)
        roi, level = document.draft.roi, document.draft.level
        assert roi is not None
        step: HandleStep | None = None
        while pointer.kind != "release":
            pointer = yield
            drag = np.array(pointer.xy) - start
            if np.linalg.norm(drag) < SLIP and step is None:
                continue
            matrix = similarity(context.view, motion, drag, grasp, middle)
            step = HandleStep(roi, patch, tuple(matrix.ravel().tolist()), level, options.method)
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
    inner = shrunk(mesh.topology, Region(mesh, roi).roi, FREE_RINGS)
    patch = connected_to(
        mesh.topology, np.intersect1d(np.union1d(near, [hit.vertex]), inner), hit.vertex
    )
    if len(patch) == 0:
        raise EngineError(
            "The handle is too near to the region's rim, which stays. Press further inside, or "
            "choose a larger region."
        )
    return patch, hit.point


def similarity(view: View, motion: Motion, drag: F64, grasp: F64, middle: F64) -> F64:
    """Return the motion of the patch as a matrix (4, 4) that a drag (2,) px asks for.

    "move" keeps the grasp below the pointer, in the plane through it parallel to the picture. The
    others leave the middle where it is: "turn" rolls the patch like a ball under the hand, "twist"
    turns it about the line of sight, "scale" grows it to the right and up.
    """
    M = np.eye(4)
    if motion == "move":
        M[:3, 3] = in_picture_plane(view, grasp, drag)
        return M
    right, down, away = picture_axes(view)
    if motion == "scale":
        linear = 2.0 ** ((drag[0] - drag[1]) / PIXELS_A_DOUBLING) * np.eye(3)
    elif motion == "twist":
        linear = rotation(away, 2 * np.pi * drag[0] / PIXELS_A_TURN)
    else:
        length = float(np.linalg.norm(drag))
        along = (drag[0] * right + drag[1] * down) / max(length, 1e-12)
        linear = rotation(np.cross(-away, along), 2 * np.pi * length / PIXELS_A_TURN)
    M[:3, :3] = linear
    M[:3, 3] = middle - linear @ middle
    return M


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
