"""Aside: what takes longer than a moment is worked out in a thread, and handed over ready made."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from PySide6.QtCore import QObject, Qt, Signal

T = TypeVar("T")
MANY = 50_000  # vertices that the window's thread can look at in a moment

Asked = tuple[Callable[[], Any], Callable[[Any], None]]


class Aside(QObject):
    """Works things out of several kinds, one of a kind at a time; of one kind the newest counts."""

    _made = Signal(str, object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._wanted: dict[str, Asked] = {}
        self._begun: dict[str, Asked] = {}
        self._made.connect(self._take, Qt.ConnectionType.QueuedConnection)

    @property
    def under_way(self) -> bool:
        """Whether something that is still wanted is being worked out."""
        return bool(self._wanted)

    def wants(self, kind: str) -> bool:
        """Whether something of a kind is being worked out."""
        return kind in self._wanted

    def ask(self, kind: str, work: Callable[[], T], take: Callable[[T], None]) -> None:
        """Have `work` done in a thread, and `take` called in this one with what it gave."""
        self._wanted[kind] = (work, take)
        if kind not in self._begun:
            self._begin(kind)

    def drop(self, kind: str) -> None:
        """What was asked for is not wanted any more."""
        self._wanted.pop(kind, None)

    def clear(self) -> None:
        """Nothing is wanted any more."""
        self._wanted.clear()

    def _begin(self, kind: str) -> None:
        self._begun[kind] = work, _take = self._wanted[kind]

        def run() -> None:
            made, error = None, None
            try:
                made = work()
            except Exception as raised:  # noqa: BLE001 (it is raised where it was asked for)
                error = raised
            with suppress(RuntimeError):  # the window was closed meanwhile
                self._made.emit(kind, made, error)

        threading.Thread(target=run, name=kind, daemon=True).start()

    def _take(self, kind: str, made: Any, error: Exception | None) -> None:
        begun, wanted = self._begun.pop(kind), self._wanted.get(kind)
        if wanted is begun:
            del self._wanted[kind]
            if error is not None:
                raise error
            begun[1](made)
        elif wanted is not None:
            self._begin(kind)
