"""All that an author of an edit tool imports.

A *tool* is what a person holds: it turns pointer events into a new document or a step. A *step* is
what a recipe holds: resolved data with one `apply(mesh, run)`. An ordinary plugin is one small file
with one of each; `resources/examples/plugin_in_20_lines.py` is a whole one.

How it is found
    An installed distribution offers its tools and steps by entry points, under the tool's `id` and
    the step's `kind`::

        [project.entry-points."eigenform.tools"]
        push = "my_plugin:Push"

        [project.entry-points."eigenform.steps"]
        push = "my_plugin:PushStep"

    Or a single file lies in the plugin folder and the person switches it on (Help, Plugins).

What a tool may do
    Read the `Context`, preview, and return a `Document` with another draft, a `Step`, or None. Only
    a step changes the mesh. Positions on the screen are logical pixels from the top left corner,
    positions in space mesh units. Tell the person what is wrong by raising `EngineError` with the
    fact and the remedy. Whatever else is raised, nonsense that is returned, and a call that does
    not come back within ten seconds ends the tool until the next start; the document stays as it
    was. A sentence names an action by its id, "Press {tool.lasso}": the person reads the key that
    it has now, and can click it.

What a step must do
    `apply` is a function of the step's data and the mesh: the same bits whenever it is called. It
    runs beside the window, so it touches nothing of it; it calls `run.tick(fraction, words)` at
    least every few seconds, which also lets it be cancelled, and keeps costly things that a
    moving hand asks for again in `run.memo`. It returns `mesh.with_vertices(...)`; arrays of a
    mesh are read-only. What gives no tick for a minute is left behind.

Versions
    `API_VERSION` counts changes that can break a plugin: a name taken away, or another meaning.
    New names come without a new number. A plugin that must be sure compares it on import and raises
    ImportError; that reason is then shown in the list of plugins.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

from engine import (
    DataStep,
    Decomposition,
    Document,
    Draft,
    EngineError,
    Mesh,
    Morph,
    Nearby,
    RecipeError,
    Region,
    Run,
    Source,
    Step,
    Stroke,
    View,
    anchor_path,
    closest_points,
    connected_to,
    cotangent_stiffness,
    decompose,
    decompose_until,
    drag_patch,
    drag_patches,
    factorise,
    figure,
    grown,
    mirrored_region,
    redraw_part,
    reflected,
    reflection,
    remesh,
    resample_target,
    shrunk,
    silhouette_chain,
    symmetry_plane,
    tidy_stroke,
    trace_anchors,
    vertex_areas,
    without_specks,
)
from engine.arrays import B1, F64, I64
from plugins.option import option
from plugins.parts import taken_apart

API_VERSION = 1
"""Version of this module; see above."""

Side = Literal["right", "left", "front", "back", "top", "bottom"]
"""A side of the form, as the view cube names it."""

REGION_FIRST = "Choose a region first: press {tool.lasso} and circle the part you want to reshape"
"""The hint of tools that work on a region, while there is none."""

Role = Literal["region", "rim", "source", "target", "pin", "guide"]


@dataclass(frozen=True)
class Pointer:
    """One event of mouse, pen or touchpad, in logical pixels from the top left corner.

    The kind "enter" is the Enter key; only gestures of tools that wait for it get it. `pressure` is
    0..1, and 1 for what has none; `time` is in seconds, and only differences of it mean something.
    """

    kind: Literal["press", "move", "release", "hover", "enter"]
    x: float
    y: float
    pressure: float = 1.0
    pen: bool = False
    eraser: bool = False
    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    time: float = 0.0
    double: bool = False

    @property
    def xy(self) -> tuple[float, float]:
        """Position in logical pixels."""
        return (self.x, self.y)


@dataclass(frozen=True, eq=False)
class Hit:
    """What lies under a pixel: the face, its nearest vertex, and the point on the surface."""

    face: int
    vertex: int
    point: F64


class Context(Protocol):
    """What a tool sees of the window and may do with it."""

    @property
    def document(self) -> Document:
        """The document as it is now."""
        ...

    @property
    def options(self) -> Any:
        """The tool's options, an instance of `Tool.Options`, as the person set them."""
        ...

    @property
    def view(self) -> View:
        """The camera as it is now."""
        ...

    @property
    def shown(self) -> Mesh:
        """The surface as it is displayed now (at the level, or deformed)."""
        ...

    @property
    def decomposition(self) -> Decomposition | None:
        """What is known of the region so far: its base and the modes that are there, or None."""
        ...

    def pick(self, x: float, y: float) -> Hit | None:
        """Return what is visible at a pixel, or None over the background."""
        ...

    def vertices_inside(self, polygon: F64, through: bool = False) -> I64:
        """Return ids of the vertices inside a closed lasso (p, 2) px, the visible ones or all."""
        ...

    def vertices_near(self, x: float, y: float, radius: float, through: bool = False) -> I64:
        """Return ids of the vertices within `radius` px of a pixel, the visible ones or all."""
        ...

    def faces_at(self, points: F64) -> I64:
        """Return the id of the visible face at each of many pixels (p, 2), (p,); -1 for none."""
        ...

    def faces_under(self, path: F64) -> I64:
        """Return ids of the visible faces below a path (p, 2) px, in the path's order."""
        ...

    def draw(self, path: F64, role: Role, closed: bool = False) -> None:
        """Show ink (p, 2) px over the scene until the gesture ends."""
        ...

    def mark(self, ids: I64 | None) -> None:
        """Show `ids` as the region until the gesture ends; nothing is computed for it."""
        ...

    def towards(self, side: Side) -> F64:
        """Return the unit direction (3,) from the middle of the form to one of its sides."""
        ...

    def notice(self, text: str) -> None:
        """Tell the person something that stays for some seconds, also after the gesture."""
        ...

    def span(self, first: F64, last: F64, text: str) -> None:
        """Show a line between two points (3,) with words, until the tool is put away."""
        ...

    def preview(self, change: Document | Step) -> None:
        """Show what `change` would give, as soon as it is computed; the newest wins."""
        ...

    def say(self, text: str) -> None:
        """Put a sentence where the hint is, until the gesture ends."""
        ...


Result = Document | Step | None
Gesture = Generator[None, Pointer, Result]


@dataclass(frozen=True)
class NoOptions:
    """For tools without options."""


class Tool:
    """Base of all tools.

    A tool is a generator: `gesture` gets the press, receives every further event by `yield`, and
    returns a document, a step to apply, or None. Escape closes the generator. Example::

        def gesture(self, context, pointer):
            path = [pointer.xy]
            while pointer.kind != "release":
                pointer = yield
                path.append(pointer.xy)
                context.draw(np.array(path), "region")
            return ...

    Attributes
    ----------
    id : unique and stable, the name of its entry point.
    title, tip : a word and a sentence for the tool rail.
    icon : name of an icon (Material Design icons, e.g. "mdi6.lasso").
    shortcut : one key; it is left out when something else has it already.
    label : what the history says after a gesture.
    order : place in the tool rail, small numbers first.
    navigates : whether strokes move the camera while the tool is in hand.
    live : whether what `enter` returns is previewed as the person sets the options.
    repeats : whether the tool stays in hand after a gesture; if not, the flow goes on with the
        tool that `claims` the new document.
    waits : whether a gesture may go on after the release, for further presses, until Enter.
    sized : the option that is the radius of its circle: keys, and a drag with Alt, change it.
    Options : a frozen dataclass of plain fields (bool, int, float, str, Literal), best made by
        `option`. The window makes the controls.
    """

    id: ClassVar[str]
    title: ClassVar[str]
    tip: ClassVar[str] = ""
    icon: ClassVar[str] = "mdi6.puzzle"
    shortcut: ClassVar[str] = ""
    label: ClassVar[str] = ""
    order: ClassVar[int] = 100
    navigates: ClassVar[bool] = False
    live: ClassVar[bool] = False
    repeats: ClassVar[bool] = True
    waits: ClassVar[bool] = False
    sized: ClassVar[str] = ""
    Options: ClassVar[type] = NoOptions

    def available(self, document: Document) -> bool:
        """Whether the tool can be used on this document now."""
        return True

    def claims(self, document: Document) -> bool:
        """Whether this tool is the natural next one for a document: the flow hands over to it."""
        return False

    def hint(self, document: Document) -> str:
        """Say in one line what to do next with this tool."""
        return self.tip

    def circle(self, options: Any) -> float | None:
        """Radius in px of a circle to show around the pointer, or None for none."""
        return None

    def draws(self, document: Document) -> Role | None:
        """Role of the curve that a gesture would draw now; None where it takes hold of something.

        By keys a curve is drawn through points set one by one, and shown in that role meanwhile.
        """
        return None

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Handle one press, its moves and its release."""
        raise NotImplementedError

    def enter(self, context: Context) -> Result:
        """Do what Enter or the Apply button asks for; None when there is nothing to apply."""
        return context.document.draft.edit()


class RegionTool(Tool):
    """Base of tools that change the chosen region by numbers: options, a live preview, Enter.

    A subclass says `step(roi, options, document)`; there is nothing to draw.
    """

    live: ClassVar[bool] = True

    def available(self, document: Document) -> bool:
        """There must be a region to work on."""
        return document.draft.roi is not None

    def hint(self, document: Document) -> str:
        """Say what to set, and how to keep it."""
        if document.draft.roi is None:
            return REGION_FIRST
        return f"{self.tip}. {{edit.apply}} applies it"

    def gesture(self, context: Context, pointer: Pointer) -> Gesture:
        """Take no strokes."""
        yield from ()
        return None

    def enter(self, context: Context) -> Result:
        """Return the step for the region and the options as they are.

        Raises
        ------
        EngineError
            No region is chosen.
        """
        roi = context.document.draft.roi
        if roi is None:
            raise EngineError("There is no region. Press {tool.lasso} and circle a part first.")
        return self.step(roi, context.options, context.document)

    def step(self, roi: I64, options: Any, document: Document) -> Step:
        """Return the step that these options ask for on the region `roi`, ascending vertex ids."""
        raise NotImplementedError


__all__ = [
    "API_VERSION",
    "B1",
    "Context",
    "DataStep",
    "Decomposition",
    "Document",
    "Draft",
    "EngineError",
    "F64",
    "Gesture",
    "Hit",
    "I64",
    "Mesh",
    "Morph",
    "Nearby",
    "NoOptions",
    "Pointer",
    "RecipeError",
    "Region",
    "RegionTool",
    "Result",
    "Role",
    "Run",
    "Source",
    "Step",
    "Stroke",
    "Tool",
    "View",
    "anchor_path",
    "closest_points",
    "connected_to",
    "cotangent_stiffness",
    "decompose",
    "decompose_until",
    "drag_patch",
    "drag_patches",
    "factorise",
    "figure",
    "grown",
    "option",
    "mirrored_region",
    "redraw_part",
    "reflected",
    "reflection",
    "remesh",
    "resample_target",
    "shrunk",
    "silhouette_chain",
    "symmetry_plane",
    "taken_apart",
    "tidy_stroke",
    "trace_anchors",
    "without_specks",
    "vertex_areas",
]
