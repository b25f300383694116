"""Run: how a long computation reports, is cancelled, and remembers what it already worked out."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from engine.errors import Cancelled

T = TypeVar("T")


class Memo:
    """A small bounded cache of results by their immutable inputs; nothing is ever invalidated.

    Parameters
    ----------
    entries : how many results are kept; the one used longest ago goes first.
    """

    def __init__(self, entries: int = 8) -> None:
        self._entries = entries
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Return the result kept under `key`, or compute, keep and return it."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                found: T = self._kept[key]
                return found
        result = compute()
        with self._lock:
            self._kept[key] = result
            self._kept.move_to_end(key)
            while len(self._kept) > self._entries:
                self._kept.popitem(last=False)
        return result

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._kept.clear()


class Run:
    """One computation under way.

    Parameters
    ----------
    report : called with (fraction in 0..1, words) whenever there is progress; None for silence.
    memo : where factorisations and decompositions are kept between runs; None for a fresh one.

    Notes
    -----
    The engine calls `tick` often; whoever wants it to stop calls `cancel` from any thread.
    """

    def __init__(
        self, report: Callable[[float, str], None] | None = None, memo: Memo | None = None
    ) -> None:
        self._report = report
        self._cancelled = threading.Event()
        self.memo = Memo() if memo is None else memo

    def tick(self, fraction: float, text: str) -> None:
        """Report progress.

        Raises
        ------
        Cancelled
            Somebody asked this run to stop.
        """
        if self._cancelled.is_set():
            raise Cancelled
        if self._report is not None:
            self._report(fraction, text)

    def cancel(self) -> None:
        """Ask the computation to stop at its next tick."""
        self._cancelled.set()

    @property
    def cancelled(self) -> bool:
        """Whether somebody asked this run to stop."""
        return self._cancelled.is_set()
