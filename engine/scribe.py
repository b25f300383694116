"""Scribe: the thread that keeps the journal, so that whoever draws never waits for a disk."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from engine.document import HistoryState
from engine.errors import EngineError
from engine.journal import Journal, Why

log = logging.getLogger(__name__)

SYNC_AFTER = 0.5
"""Seconds without a new state after which the bytes are made to survive a power cut too. Against a
kill of the program they are safe as soon as they are written."""
RETRY_SECONDS = 10.0
"""After a failure (a full disk) the next attempt waits this long, unless something is closed."""


class Scribe:
    """Writes the states of one document after the other to journals, in the background.

    Parameters
    ----------
    folder : where journals are.
    on_problem : called in the scribe's thread with a sentence when the journal cannot be written,
        and with "" when it can be again.
    """

    def __init__(self, folder: Path, on_problem: Callable[[str], None] | None = None) -> None:
        self._folder = folder
        self._on_problem = on_problem or (lambda _sentence: None)
        self._wake = threading.Condition()
        self._orders: deque[tuple[str, Callable[[], None]]] = deque()
        self._busy = False
        self._unsynced = False
        self._ending = False
        self._journal: Journal | None = None
        self._failed_ones: list[Journal] = []
        self._failed_at: float | None = None
        self._thread = threading.Thread(target=self._serve, name="scribe", daemon=True)
        self._thread.start()

    def begin(
        self,
        state: HistoryState,
        safe_in: str | None = None,
        then: Callable[[], None] | None = None,
    ) -> None:
        """Take up another document; the journal of the one before must have been ended.

        Parameters
        ----------
        state : its history.
        safe_in : the file that holds all of it; None when it is nowhere else yet.
        then : called in the scribe's thread once all of it is on the disk.
        """
        self._order("begin", lambda: self._begin(state, safe_in, then))

    def write(self, state: HistoryState) -> None:
        """Write what is new; a state that waits is passed over for a newer one."""
        self._order("write", lambda: self._write(state))

    def saved(self, path: str, state: HistoryState) -> None:
        """Note that `state` is safe in a file."""
        self._order("saved", lambda: self._saved(path, state))

    def end(self, keep: Why | None = None) -> None:
        """End the document's journal: remove it, or keep it for the next start."""
        self._order("end", lambda: self._end(keep))

    def flush(self, seconds: float = 10.0) -> bool:
        """Wait until everything handed over so far is written; whether that came about."""
        with self._wake:
            return self._wake.wait_for(lambda: not self._orders and not self._busy, seconds)

    def stop(self, seconds: float = 10.0) -> None:
        """Write what is left and end the thread."""
        with self._wake:
            self._ending = True
            self._wake.notify_all()
        self._thread.join(seconds)

    def _order(
        self, kind: Literal["begin", "write", "saved", "end"], do: Callable[[], None]
    ) -> None:
        with self._wake:
            if kind == "write" and self._orders and self._orders[-1][0] == "write":
                self._orders.pop()
            self._orders.append((kind, do))
            self._wake.notify_all()

    # ---- the scribe's thread

    def _serve(self) -> None:
        while True:
            with self._wake:
                pause = SYNC_AFTER if self._unsynced else None
                self._wake.wait_for(lambda: self._orders or self._ending, pause)
                if not self._orders and not self._unsynced:
                    break
                do = self._orders.popleft()[1] if self._orders else self._sync
                self._busy = True
            try:
                do()
            except EngineError as error:
                self._failed(str(error))
            except Exception as error:
                # A plugin's step that cannot be written must not end the journal of all others.
                log.exception("The journal could not be written")
                self._failed(f"The recovery copy could not be written ({error}).")
            else:
                if self._failed_at is not None and self._journal is not None:
                    self._failed_at = None
                    self._on_problem("")
            with self._wake:
                self._busy = False
                self._wake.notify_all()

        self._abandon()

    def _abandon(self) -> None:
        for journal in (*self._failed_ones, *([self._journal] if self._journal else [])):
            journal.abandon()

    def _failed(self, sentence: str) -> None:
        # What of the state reached the file is not known: the next attempt begins a new one, and
        # what the old one holds is kept until then.
        if self._journal is not None:
            self._failed_ones.append(self._journal)
        self._journal = None
        if self._failed_at is None:
            self._on_problem(sentence)
        self._failed_at = time.monotonic()

    def _begin(
        self, state: HistoryState, safe_in: str | None, then: Callable[[], None] | None
    ) -> None:
        self._journal = Journal(self._folder)
        self._journal.write(state)
        if safe_in is not None:
            self._journal.saved(safe_in, state)
        self._unsynced = True
        if then is not None:
            self._sync()
            then()

    def _write(self, state: HistoryState) -> None:
        if self._journal is None:
            waited = self._failed_at is None or time.monotonic() - self._failed_at > RETRY_SECONDS
            if not waited:
                return
            self._journal = Journal(self._folder)
        self._journal.write(state)
        self._unsynced = True
        self._forget_failed_ones()

    def _saved(self, path: str, state: HistoryState) -> None:
        if self._journal is not None:
            self._journal.saved(path, state)
            self._unsynced = True

    def _sync(self) -> None:
        self._unsynced = False
        if self._journal is not None:
            self._journal.sync()

    def _end(self, keep: Why | None) -> None:
        journal, self._journal = self._journal, None
        if journal is not None or keep is None:
            self._forget_failed_ones()
        for failed in self._failed_ones:
            failed.abandon()
        self._failed_ones.clear()
        if journal is not None and keep is None:
            journal.remove()
        elif journal is not None and keep is not None:
            journal.keep(keep)

    def _forget_failed_ones(self) -> None:
        for journal in self._failed_ones:
            journal.remove()
        self._failed_ones.clear()
