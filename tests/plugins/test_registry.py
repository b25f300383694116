"""Plugins are found by entry points; what fails is listed with its reason."""

from __future__ import annotations

from importlib.metadata import EntryPoint

from plugins.api import NoOptions, Tool
from plugins.registry import STEPS, TOOLS, find_steps, find_tools, kinds


class Good(Tool):
    id = "good"
    title = "Good"
    order = 5


class Misnamed(Tool):
    id = "other"
    title = "Misnamed"


class Untitled(Tool):
    id = "untitled"


class WithOddOptions(Tool):
    id = "odd"
    title = "Odd"
    Options = int


class NoStep:
    kind = "nostep"


def point(name: str, what: str, group: str = TOOLS) -> EntryPoint:
    return EntryPoint(name, f"{__name__}:{what}", group)


def test_the_built_in_tools_come_in_their_order() -> None:
    found = find_tools()
    assert found.failures == ()
    names = list(found.items)
    assert names[:3] == ["lasso", "source", "target"] or names.index("lasso") < names.index(
        "source"
    )
    assert {"lasso", "source", "target"} <= set(names)
    assert "sketch" in kinds()


def test_what_fails_is_listed_with_the_reason() -> None:
    found = find_tools(
        [
            point("good", "Good"),
            point("good", "Good"),
            point("misnamed", "Misnamed"),
            point("untitled", "Untitled"),
            point("odd", "WithOddOptions"),
            point("absent", "Absent"),
            point("number", "TOOLS"),
            EntryPoint("nowhere", "no_such_module:Tool", TOOLS),
        ]
    )
    assert list(found.items) == ["good"]
    reasons = {failure.name: failure.reason for failure in found.failures}
    assert "already offers the name" in reasons["good"]
    assert "its id is “other”" in reasons["misnamed"]
    assert "no text “title”" in reasons["untitled"]
    assert "Options are not a dataclass" in reasons["odd"]
    assert "no attribute" in reasons["absent"]
    assert "not a subclass" in reasons["number"]
    assert "No module named 'no_such_module'" in reasons["nowhere"]
    assert all(str(one).startswith("The tool “") for one in found.failures)


def test_a_step_must_be_one() -> None:
    found = find_steps([point("nostep", "NoStep", STEPS), point("good", "Good", STEPS)])
    assert found.items == {}
    assert "apply" in found.failures[0].reason


def test_options_of_a_tool_without_any_are_empty() -> None:
    assert Good.Options is NoOptions
