"""Importing what strangers wrote: in a thread of its own, and only for so long."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TypeVar

from plugins.interruption import InterruptibleThread, LeftBehindError

T = TypeVar("T")

SECONDS = 10.0

_hung: set[Hashable] = set()


class ImportHungError(ImportError):
    """A module did not come back from being imported."""

    def __str__(self) -> str:
        return f"it was not imported within {SECONDS:g} seconds"


def imported(key: Hashable, load: Callable[[], T]) -> T:
    """Return what `load` returns, if it does so in time.

    A module may loop, wait for a network, or raise what would end the program. One that hung is not
    tried again before the next start.

    Parameters
    ----------
    key : what is imported.
    load : imports it.

    Raises
    ------
    ImportHungError
        It takes too long, or did before.
    Exception
        Whatever `load` raises; what is no `Exception` becomes an `ImportError` that names it.
    """
    if key in _hung:
        raise ImportHungError
    made: list[T] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            made.append(load())
        except LeftBehindError:
            raise
        except BaseException as error:  # noqa: BLE001 - told by whoever waits for it
            errors.append(error)

    thread = InterruptibleThread("import", work)
    thread.start()
    thread.join(SECONDS)
    if made:
        return made[0]
    if not errors:
        _hung.add(key)
        thread.interrupt()
        raise ImportHungError
    if isinstance(errors[0], Exception):
        raise errors[0]
    raise ImportError(f"it raised {type(errors[0]).__name__}: {errors[0]}") from errors[0]
