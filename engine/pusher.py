"""Pusher: the thread that waits for the disk, so that no state waits behind another one's bytes.

What the system has taken outlives a kill of the program; only a power cut needs the disk itself.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable

from engine.errors import EngineError
from engine.journal import Journal

log = logging.getLogger(__name__)

QUIET = 0.5
"""Seconds without a new state after which the bytes are pushed to the disk."""
AT_LATEST = 5.0
"""Seconds after which they are pushed though there is no quiet."""

Work = tuple[Journal, Callable[[], None]]


class Pusher:
    """Pushes journals to the disk and ends them, one after the other.

    Parameters
    ----------
    failed : called in this thread with a journal and a sentence when the disk refuses its bytes.
    """

    def __init__(self, failed: Callable[[Journal, str], None]) -> None:
        self._failed = failed
        self._wake = threading.Condition()
        self._work: deque[Work] = deque()
        self._busy = False
        self._ending = False
        self._unpushed: Journal | None = None
        self._first = self._last = 0.0
        self._thread = threading.Thread(target=self._serve, name="pusher", daemon=True)
        self._thread.start()

    def later(self, journal: Journal) -> None:
        """Push what a journal holds once it is quiet; however often this is asked, once."""
        now = time.monotonic()
        with self._wake:
            self._last = now
            if self._unpushed is not journal:
                self._unpushed, self._first = journal, now
                self._wake.notify_all()

    def soon(self, journal: Journal, do: Callable[[], None]) -> None:
        """Do something with a journal that may take the disk's time, after what waits."""
        with self._wake:
            if self._unpushed is journal:
                self._unpushed = None
            self._work.append((journal, do))
            self._wake.notify_all()

    def flush(self, seconds: float) -> bool:
        """Wait until nothing waits but what is pushed later; whether that came about."""
        with self._wake:
            return self._wake.wait_for(lambda: not self._work and not self._busy, seconds)

    def stop(self, seconds: float) -> None:
        """Push what is left and end the thread."""
        with self._wake:
            self._ending = True
            self._wake.notify_all()
        self._thread.join(seconds)

    # ---- the pusher's thread

    def _serve(self) -> None:
        while (work := self._next()) is not None:
            journal, do = work
            try:
                do()
            except (EngineError, OSError) as error:
                self._failed(journal, str(error))
            except Exception as error:
                log.exception("The journal could not be ended")
                self._failed(journal, f"The recovery copy could not be written ({error}).")
            with self._wake:
                self._busy = False
                self._wake.notify_all()

    def _next(self) -> Work | None:
        """Wait for something to do; None at the end."""
        with self._wake:
            while True:
                if self._work:
                    self._busy = True
                    return self._work.popleft()
                journal = self._unpushed
                if journal is None:
                    if self._ending:
                        return None
                    self._wake.wait()
                    continue
                due = min(self._last + QUIET, self._first + AT_LATEST)
                left = due - time.monotonic()
                if left <= 0 or self._ending:
                    self._unpushed = None
                    self._busy = True
                    return journal, journal.sync
                self._wake.wait(left)
