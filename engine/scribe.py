"""Scribe: the thread that keeps the journal, so that whoever draws never waits for a disk.

A state is handed over only once the one before it is written, so a kill of the program loses the
newest state at most, that is one stroke. The wait is none for a hand that draws; a disk that takes
longer than `PATIENCE` over one state is waited for once, and not again until it has caught up.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from engine.document import HistoryState
from engine.errors import EngineError, FileError
from engine.files.place import Stamp
from engine.journal import Journal, Why
from engine.pusher import Pusher

log = logging.getLogger(__name__)

PATIENCE = 0.03
"""Seconds a state waits at most for the one before it to be written: the window hands it over."""
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
        self._writing = False
        self._behind = False
        self._ending = False
        self._journal: Journal | None = None
        self._failed_ones: list[Journal] = []
        self._failed_at: float | None = None
        self._pusher = Pusher(self._push_failed)
        self._thread = threading.Thread(target=self._serve, name="scribe", daemon=True)
        self._thread.start()

    def begin(
        self,
        state: HistoryState,
        file: str = "",
        stamp: Stamp | None = None,
        *,
        safe: bool = True,
        then: Callable[[], None] | None = None,
    ) -> None:
        """Take up another document; the journal of the one before must have been ended.

        Parameters
        ----------
        state : its history.
        file : the file that it belongs to; "" if there is none.
        stamp : what this file had when it was read; None if that is not known.
        safe : whether nothing of it is lost without the journal.
        then : called in a thread of its own once all of it is on the disk.
        """
        self._order("begin", lambda: self._begin(state, file, stamp, safe, then))

    def write(self, state: HistoryState) -> None:
        """Write what is new, once the state before it is written or `PATIENCE` is at an end.

        A state that waits then is passed over for the newer one.
        """
        with self._wake:
            if not self._behind:
                self._behind = not self._wake.wait_for(lambda: not self._write_waits, PATIENCE)
        self._order("write", lambda: self._write(state))

    def saved(self, path: str, state: HistoryState, stamp: Stamp | None = None) -> None:
        """Note that `state` is safe in a file, which has the `stamp` since."""
        self._order("saved", lambda: self._saved(path, state, stamp))

    def end(self, keep: Why | None = None) -> None:
        """End the document's journal: remove it, or keep it for the next start."""
        self._order("end", lambda: self._end(keep))

    def flush(self, seconds: float = 10.0) -> bool:
        """Wait until everything handed over so far is written; whether that came about."""
        until = time.monotonic() + seconds
        with self._wake:
            done = self._wake.wait_for(lambda: not self._orders and not self._busy, seconds)
        return done and self._pusher.flush(max(0.0, until - time.monotonic()))

    def stop(self, seconds: float = 10.0) -> None:
        """Write what is left and end the thread."""
        with self._wake:
            self._ending = True
            self._wake.notify_all()
        until = time.monotonic() + seconds
        self._thread.join(seconds)
        self._pusher.stop(max(0.0, until - time.monotonic()))

    @property
    def _write_waits(self) -> bool:
        return self._writing or any(kind == "write" for kind, _do in self._orders)

    def _order(
        self,
        kind: Literal["begin", "write", "saved", "end", "failed"],
        do: Callable[[], None],
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
                self._wake.wait_for(lambda: self._orders or self._ending)
                if not self._orders:
                    break
                kind, do = self._orders.popleft()
                self._busy = True
                self._writing = kind == "write"
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
                self._busy = self._writing = False
                self._behind = self._behind and bool(self._orders)
                self._wake.notify_all()

        for journal in (*self._failed_ones, *([self._journal] if self._journal else [])):
            self._pusher.soon(journal, journal.keep)

    def _push_failed(self, journal: Journal, sentence: str) -> None:
        """Take up a failure of the pusher's, in the pusher's thread."""

        def fail() -> None:
            if self._journal is journal:
                raise FileError(sentence)

        self._order("failed", fail)

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
        self,
        state: HistoryState,
        file: str,
        stamp: Stamp | None,
        safe: bool,
        then: Callable[[], None] | None,
    ) -> None:
        journal = self._journal = Journal(self._folder)
        journal.belongs_to(file, stamp)
        journal.write(state)
        if safe:
            journal.saved(file, state, stamp)
        if then is None:
            self._pusher.later(journal)
            return

        def push() -> None:
            journal.sync()
            then()

        self._pusher.soon(journal, push)

    def _write(self, state: HistoryState) -> None:
        if self._journal is None:
            waited = self._failed_at is None or time.monotonic() - self._failed_at > RETRY_SECONDS
            if not waited:
                return
            self._journal = Journal(self._folder)
        self._journal.write(state)
        self._pusher.later(self._journal)
        self._forget_failed_ones()

    def _saved(self, path: str, state: HistoryState, stamp: Stamp | None) -> None:
        if self._journal is not None:
            self._journal.saved(path, state, stamp)
            self._pusher.later(self._journal)

    def _end(self, keep: Why | None) -> None:
        journal, self._journal = self._journal, None
        if journal is not None or keep is None:
            self._forget_failed_ones()
        for failed in self._failed_ones:
            self._pusher.soon(failed, failed.abandon)
        self._failed_ones.clear()
        if journal is not None and keep is None:
            self._pusher.soon(journal, journal.remove)
        elif journal is not None and keep is not None:
            try:
                journal.closed(keep)
            finally:
                self._pusher.soon(journal, journal.keep)

    def _forget_failed_ones(self) -> None:
        for journal in self._failed_ones:
            self._pusher.soon(journal, journal.remove)
        self._failed_ones.clear()
