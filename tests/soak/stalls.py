"""How long the window's thread is kept by our own code, without what software OpenGL takes.

Every call that Qt makes into Python below the loop that pumps its events is timed: in processor
time of this thread (what our code costs) and in wall time (with waiting for the interpreter, and
for the other programs of a busy machine).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import CodeType, FrameType
from typing import Any

TraceFunction = Callable[[FrameType, str, Any], Any]


@dataclass(frozen=True)
class Stall:
    """One call from Qt: seconds of processor and wall time without rendering, and its name."""

    cpu: float
    wall: float
    where: str


@dataclass
class Stopwatch:
    """Times the calls that come from `pump`, by the interpreter's tracing hook.

    The hook is asked at calls into Python only, not at returns and calls into native code: a
    profiling hook would add half as much again to what it measures.

    Parameters
    ----------
    pump : the function from which all events are sent and processed.
    drawing : functions whose time is rendering; it is not counted.
    keep_above : calls that take longer, in seconds, are kept.
    doing : what is being done, for the name of a stall.
    """

    pump: CodeType
    drawing: frozenset[CodeType]
    keep_above: float = 0.02
    stalls: list[Stall] = field(default_factory=list)
    calls: int = 0
    doing: str = ""
    _root: FrameType | None = None
    _began: tuple[float, float] = (0.0, 0.0)
    _drawn: tuple[float, float] = (0.0, 0.0)
    _drawing: FrameType | None = None
    _drawing_began: tuple[float, float] = (0.0, 0.0)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Measure in this thread."""
        before = sys.gettrace()
        sys.settrace(self._called)
        try:
            yield
        finally:
            sys.settrace(before)

    def _called(self, frame: FrameType, _event: str, _given: Any) -> TraceFunction | None:
        """A function begins; return what is told of its end if that matters."""
        if self._root is None:
            caller = frame.f_back
            if caller is None or caller.f_code is not self.pump:
                return None
            self._root = frame
            self._drawn = (0.0, 0.0)
            self._began = (time.thread_time(), time.perf_counter())
            self.calls += 1
        if self._drawing is None and frame.f_code in self.drawing:
            self._drawing = frame
            self._drawing_began = (time.thread_time(), time.perf_counter())
        elif frame is not self._root:
            return None
        frame.f_trace_lines = False
        return self._ended

    def _ended(self, frame: FrameType, event: str, _given: Any) -> TraceFunction:
        if event == "return":
            if frame is self._drawing:
                self._drawing = None
                cpu, wall = self._drawing_began
                self._drawn = (
                    self._drawn[0] + time.thread_time() - cpu,
                    self._drawn[1] + time.perf_counter() - wall,
                )
            if frame is self._root:
                self._root = None
                cpu = time.thread_time() - self._began[0] - self._drawn[0]
                wall = time.perf_counter() - self._began[1] - self._drawn[1]
                if wall > self.keep_above:
                    code = frame.f_code
                    name = f"{code.co_filename.rpartition('/')[2]}:{code.co_qualname}"
                    if "lambda" in name:
                        name = self.doing
                    self.stalls.append(Stall(cpu, wall, name))
        return self._ended

    def worst(self, count: int = 5) -> list[Stall]:
        """The calls that cost most processor time."""
        return sorted(self.stalls, key=lambda one: -one.cpu)[:count]
