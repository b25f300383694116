"""XML of strangers: read as a stream, without entities and without deep nesting."""

from __future__ import annotations

from collections.abc import Callable
from xml.parsers import expat

from engine.errors import FileError

DEPTH = 200

Start = Callable[[str, dict[str, str]], None]
End = Callable[[str], None]


class _RefusedError(Exception):
    """Stops the parser; the text says why."""


def read_markup(data: bytes, name: str, start: Start, end: End | None = None) -> None:
    """Call `start(tag, attributes)` and `end(tag)` for every element; tags without their prefix.

    Raises
    ------
    FileError
        It is no well-formed XML, declares entities, or is nested deeper than any model is.
    """
    depth = 0

    def opened(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEPTH:
            raise _RefusedError(f"its elements are nested more than {DEPTH} deep")
        start(tag.rpartition(":")[2], attributes)

    def closed(tag: str) -> None:
        nonlocal depth
        depth -= 1
        if end is not None:
            end(tag.rpartition(":")[2])

    def declared(*_: object) -> None:
        raise _RefusedError("it declares entities, which can blow up a small file without bounds")

    parser = expat.ParserCreate()
    parser.StartElementHandler = opened
    parser.EndElementHandler = closed
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise _refusal(name, f"line {error.lineno:,} is no valid XML") from None
    except (LookupError, ValueError):
        raise _refusal(name, "it names an encoding of text that does not exist") from None
    except _RefusedError as reason:
        raise _refusal(name, str(reason)) from None


def _refusal(name: str, fact: str) -> FileError:
    return FileError(
        f"“{name}” cannot be read: {fact}. Export the model again or get another copy of the file."
    )
