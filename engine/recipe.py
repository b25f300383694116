"""Recipe: the steps that were done to a mesh, as data; replay does them again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NoReturn, Protocol, Self, runtime_checkable

from engine.applied import applied
from engine.edit import SketchEdit
from engine.errors import RecipeError
from engine.mesh import Mesh
from engine.run import Run

SCHEMA_VERSION = 1
LONGEST_KIND = 100


@runtime_checkable
class Step(Protocol):
    """One replayable change of a mesh: resolved data and one function.

    A step is a frozen dataclass. `kind` is its name in recipes and the name of its entry point in
    the group `eigenform.steps`.
    """

    kind: ClassVar[str]

    @property
    def title(self) -> str:
        """A few words for the list of steps."""
        ...

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        """Return the changed mesh; the faces stay the same object unless the step remeshes."""
        ...

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON data without `kind`."""
        ...

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """Build the step from what `to_json` gave; raises `RecipeError` on bad data."""
        ...


Kinds = Mapping[str, type[Step]]


@dataclass(frozen=True)
class UnknownStep:
    """A step whose plugin is not installed: kept as it was read, refused when applied."""

    name: str
    data: dict[str, Any] = field(default_factory=dict)
    kind: ClassVar[str] = "unknown"

    @property
    def title(self) -> str:
        """A few words for the list of steps."""
        return f"{self.name} (plugin missing)"

    def apply(self, mesh: Mesh, run: Run | None = None) -> Mesh:
        raise RecipeError(
            f"The recipe has a step of the kind “{self.name}”, which no installed plugin offers. "
            "Install the plugin that made it, or mute the step."
        )

    def to_json(self) -> dict[str, Any]:
        return dict(self.data)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        raise RecipeError(f"An unknown step with {len(data)} fields cannot be read by itself.")


@dataclass(frozen=True)
class Recipe:
    """Steps in the order they are applied.

    Parameters
    ----------
    steps : the steps.
    digest : `Mesh.digest` of the mesh that the first step was made on; "" when not known.
    muted : positions in `steps` that replay passes over.
    """

    steps: tuple[Step, ...] = ()
    digest: str = ""
    muted: frozenset[int] = frozenset()

    def with_step(self, step: Step) -> Recipe:
        """Return the recipe with one more step at its end."""
        return replace(self, steps=(*self.steps, step))

    def with_muted(self, position: int, muted: bool = True) -> Recipe:
        """Return the recipe with a step passed over by replay, or no longer."""
        self._check_position(position)
        others = self.muted - {position}
        return replace(self, muted=others | {position} if muted else others)

    def without_step(self, position: int) -> Recipe:
        """Return the recipe without a step."""
        self._check_position(position)
        return self._in_order([i for i in range(len(self.steps)) if i != position])

    def with_moved(self, position: int, to: int) -> Recipe:
        """Return the recipe with a step taken out and put in again at the position `to`."""
        self._check_position(position)
        self._check_position(to)
        order = [i for i in range(len(self.steps)) if i != position]
        order.insert(to, position)
        return self._in_order(order)

    def with_value(self, position: int, name: str, value: Any) -> Recipe:
        """Return the recipe with one number of a step changed.

        Parameters
        ----------
        position : of the step.
        name : of the value in the step's JSON, with dots into objects and lists:
            "level", "options.amount", "strokes.0.closed".
        value : JSON data.

        Raises
        ------
        RecipeError
            There is no such value, or the step does not take it.
        """
        self._check_position(position)
        step = self.steps[position]
        data = json.loads(json.dumps(step.to_json()))
        _set_value(data, name, value)
        changed = (
            UnknownStep(step.name, data)
            if isinstance(step, UnknownStep)
            else _read_step(type(step), data, position)
        )
        return replace(self, steps=(*self.steps[:position], changed, *self.steps[position + 1 :]))

    def _in_order(self, order: list[int]) -> Recipe:
        muted = frozenset(new for new, old in enumerate(order) if old in self.muted)
        return replace(self, steps=tuple(self.steps[i] for i in order), muted=muted)

    def _check_position(self, position: int) -> None:
        if not 0 <= position < len(self.steps):
            raise RecipeError(
                f"The recipe has {len(self.steps)} steps; there is none at position {position}. "
                "Positions count from 0."
            )

    def to_json(self) -> str:
        """Return the recipe as readable JSON text."""
        steps: list[dict[str, Any]] = []
        for i, step in enumerate(self.steps):
            kind = step.name if isinstance(step, UnknownStep) else step.kind
            entry: dict[str, Any] = {"kind": kind, **step.to_json()}
            if i in self.muted:
                entry["muted"] = True
            steps.append(entry)
        data = {"eigenform": SCHEMA_VERSION, "mesh": self.digest, "steps": steps}
        return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str, kinds: Kinds | None = None) -> Recipe:
        """Read a recipe; a kind that is not in `kinds` becomes an `UnknownStep`.

        Parameters
        ----------
        text : JSON, see resources/recipe.schema.json.
        kinds : classes of steps by kind; None for the engine's own, sketches.

        Raises
        ------
        RecipeError
            The text is not JSON, not a recipe, of a newer version, or a step's data is wrong.
        """
        data = _parsed(text)
        kinds = OWN_KINDS if kinds is None else kinds
        steps: list[Step] = []
        muted: set[int] = set()
        for i, entry in enumerate(data["steps"]):
            if not isinstance(entry, dict) or not isinstance(entry.get("kind"), str):
                raise RecipeError(f"Step {i + 1} of the recipe has no kind. Name one.")
            if len(entry["kind"]) > LONGEST_KIND or not entry["kind"].isprintable():
                raise RecipeError(
                    f"Step {i + 1} of the recipe has a kind that is no name. Correct it."
                )
            if not isinstance(entry.get("muted", False), bool):
                raise RecipeError(f"Step {i + 1}'s “muted” must be true or false.")
            if entry.get("muted"):
                muted.add(i)
            rest = {k: v for k, v in entry.items() if k not in ("kind", "muted")}
            known = kinds.get(entry["kind"])
            if known is None:
                steps.append(UnknownStep(entry["kind"], rest))
            else:
                steps.append(_read_step(known, rest, i))
        return cls(tuple(steps), data.get("mesh", ""), frozenset(muted))


OWN_KINDS: Kinds = {SketchEdit.kind: SketchEdit}
"""The kinds of steps that need no plugin."""


def _parsed(text: str) -> dict[str, Any]:
    try:
        data = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise RecipeError(
            f"The recipe is not valid JSON ({error}). Correct it there, or save it again."
        ) from error
    if not isinstance(data, dict) or not isinstance(data.get("steps"), list):
        raise RecipeError(
            "The file is not an Eigenform recipe: it has no list of steps. Choose another file."
        )
    version = data.get("eigenform")
    if type(version) is not int or version < 1:
        raise RecipeError(
            f"The recipe has the version {version!r}; it must be a whole number from 1 up. "
            "Choose a recipe that Eigenform wrote."
        )
    if version > SCHEMA_VERSION:
        raise RecipeError(
            f"The recipe has the version {version}; this program reads up to {SCHEMA_VERSION}. "
            "Update Eigenform to open it."
        )
    if not isinstance(data.get("mesh", ""), str):
        raise RecipeError("The recipe's “mesh” must be the digest of a mesh, or left out.")
    return data


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")


def _read_step(kind: type[Step], data: dict[str, Any], position: int) -> Step:
    try:
        return kind.from_json(data)
    except RecipeError as error:
        # It may repeat a number that was made absurdly long.
        raise RecipeError(f"Step {position + 1} of the recipe: {str(error)[:500]}") from error
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError, IndexError) as error:
        raise RecipeError(
            f"Step {position + 1} of the recipe ({kind.kind}) cannot be read: {str(error)[:200]}. "
            "Correct it."
        ) from error


def _set_value(data: Any, name: str, value: Any) -> None:
    """Set what a dotted name means in JSON data; a new name is allowed in the last object."""
    *way, last = name.split(".")
    for part in way:
        data = _child(data, part, name)
    if isinstance(data, dict):
        data[last] = value
    elif isinstance(data, list) and last.isdecimal() and int(last) < len(data):
        data[int(last)] = value
    else:
        raise RecipeError(f"The step has no value {name!r}. Look at its JSON for the names.")


def _child(data: Any, part: str, name: str) -> Any:
    if isinstance(data, dict) and part in data:
        return data[part]
    if isinstance(data, list) and part.isdecimal() and int(part) < len(data):
        return data[int(part)]
    raise RecipeError(f"The step has no value {name!r}. Look at its JSON for the names.")


def replay(recipe: Recipe, mesh: Mesh, run: Run | None = None, force: bool = False) -> Mesh:
    """Apply the steps of `recipe` that are not muted to `mesh`, one after the other.

    Parameters
    ----------
    recipe : the steps.
    mesh : the mesh that they were made on.
    run : progress, cancel, memory.
    force : go on although `mesh` is not the mesh that the recipe was made on.

    Raises
    ------
    RecipeError
        The mesh is another one (unless forced), or a step does not fit it.
    EngineError
        A step failed.
    """
    if recipe.digest and recipe.digest != mesh.digest and not force:
        raise RecipeError(
            "The recipe was made on another mesh (or on this one before it was changed). "
            "Open that mesh, transfer the recipe to this one, or use --force if the vertices are "
            "numbered alike."
        )
    for i, step in enumerate(recipe.steps):
        if i not in recipe.muted:
            mesh = applied(step, mesh, run)
    return mesh
