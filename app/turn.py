"""Turn: one change of the document, at whose end everything that follows it is done once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Call = Callable[[], object]


class Turn:
    """Lets many signals of one change ask for the same thing, and does it once for all of them.

    What follows the document is shown before the next key is looked at, not some time later: a key
    pressed in haste must find the action that it means.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._asked: dict[Call, None] = {}

    @contextmanager
    def under_way(self) -> Iterator[None]:
        """While a change is made; what was asked for meanwhile is done at the end of the outermost.

        It is done too when the change fails: what can be seen is to tell how far it came.
        """
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            while self._depth == 0 and self._asked:
                call = next(iter(self._asked))
                del self._asked[call]
                call()

    def once(self, call: Call) -> None:
        """Call at the end of the change under way, or now if there is none."""
        if self._depth:
            self._asked[call] = None
        else:
            call()
