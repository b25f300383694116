"""XML of strangers: read as a stream, without entities and without deep nesting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np

from engine.arrays import F64, I64
from engine.errors import FileError
from engine.files.text import decimals, tokenise, wholes

DEPTH = 200

Start = Callable[[str, dict[str, str]], None]


@dataclass(slots=True)
class Element:
    """An element of a document, with what it holds.

    Parameters
    ----------
    tag : its name without prefix.
    attributes : as written.
    children : the elements in it, in their order.
    pieces : the text directly in it.
    """

    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The text directly in it."""
        return "".join(self.pieces)

    def get(self, attribute: str, otherwise: str = "") -> str:
        """Return an attribute."""
        return self.attributes.get(attribute, otherwise)

    def all(self, *tags: str) -> list[Element]:
        """Return the children of these names."""
        return [child for child in self.children if child.tag in tags]

    def first(self, *tags: str) -> Element | None:
        """Return the first child of one of these names."""
        return next((child for child in self.children if child.tag in tags), None)

    def walk(self) -> Iterator[Element]:
        """Give it and everything in it, in the order of the document."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))


def numbers(text: str) -> F64:
    """Return the numbers that `text` spells, NaN for a word that is none or not finite."""
    tokens = tokenise(text.encode("utf-8", "replace"))
    return decimals(tokens, np.arange(len(tokens.start)))


def indices(text: str, invalid: int) -> I64:
    """Return the whole numbers that `text` spells, `invalid` for a word that is none."""
    tokens = tokenise(text.encode("utf-8", "replace"))
    values, good = wholes(tokens, np.arange(len(tokens.start)))
    return np.where(good, values, np.int64(invalid))


class _RefusedError(Exception):
    """Stops the parser; the text says why."""


def read_tree(data: bytes, name: str) -> Element:
    """Return the document's outermost element, with all that is in it.

    Raises
    ------
    FileError
        As `read_markup`.
    """
    top = Element("", {})
    opened = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes)
        opened[-1].children.append(element)
        opened.append(element)

    read_markup(data, name, start, lambda _: opened.pop(), lambda t: opened[-1].pieces.append(t))
    return top.children[0]


def read_markup(
    data: bytes,
    name: str,
    start: Start,
    end: Callable[[str], object] | None = None,
    text: Callable[[str], None] | None = None,
) -> None:
    """Call `start(tag, attributes)`, `text(piece)` and `end(tag)`; tags without their prefix.

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
    if text is not None:
        parser.buffer_text = True
        parser.buffer_size = 1 << 20
        parser.CharacterDataHandler = text
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
