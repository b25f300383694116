"""Recipe: the steps that were done to a mesh, as data; replay does them again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from engine.errors import RecipeError
from engine.mesh import Mesh
from engine.run import Run

SCHEMA_VERSION = 1


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
        raise RecipeError("An unknown step cannot be read by itself.")


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
    def from_json(cls, text: str, kinds: Kinds) -> Recipe:
        """Read a recipe; a kind that is not in `kinds` becomes an `UnknownStep`.

        Raises
        ------
        RecipeError
            The text is not JSON, not a recipe, of a newer version, or a step's data is wrong.
        """
        try:
            data = json.loads(text)
        except ValueError as error:
            raise RecipeError(f"The recipe is not valid JSON ({error}).") from error
        if not isinstance(data, dict) or not isinstance(data.get("steps"), list):
            raise RecipeError("The file is not an Eigenform recipe: it has no list of steps.")
        version = data.get("eigenform")
        if not isinstance(version, int) or version > SCHEMA_VERSION:
            raise RecipeError(
                f"The recipe has the version {version!r}; this program reads up to {SCHEMA_VERSION}. "
                "Update Eigenform to open it."
            )
        steps: list[Step] = []
        muted: set[int] = set()
        for i, entry in enumerate(data["steps"]):
            if not isinstance(entry, dict) or not isinstance(entry.get("kind"), str):
                raise RecipeError(f"Step {i + 1} of the recipe has no kind.")
            rest = {k: v for k, v in entry.items() if k not in ("kind", "muted")}
            if entry.get("muted"):
                muted.add(i)
            known = kinds.get(entry["kind"])
            if known is None:
                steps.append(UnknownStep(entry["kind"], rest))
                continue
            try:
                steps.append(known.from_json(rest))
            except RecipeError:
                raise
            except (KeyError, TypeError, ValueError, OverflowError) as error:
                raise RecipeError(
                    f"Step {i + 1} of the recipe ({entry['kind']}) cannot be read: {error}."
                ) from error
        return cls(tuple(steps), str(data.get("mesh", "")), frozenset(muted))


def replay(recipe: Recipe, mesh: Mesh, run: Run | None = None) -> Mesh:
    """Apply the steps of `recipe` that are not muted to `mesh`, one after the other."""
    for i, step in enumerate(recipe.steps):
        if i not in recipe.muted:
            mesh = step.apply(mesh, run)
    return mesh
