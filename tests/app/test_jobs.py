"""The engine thread: order, newest wins, streams, urgent work in between, cancel, errors."""

from __future__ import annotations

import gc
import threading
import weakref
from collections.abc import Iterator
from itertools import count
from types import SimpleNamespace

import pytest

import app.jobs
from app.jobs import Jobs
from engine import EngineError, Run
from tests.program import PATIENCE


@pytest.fixture
def jobs(qtbot) -> Iterator[Jobs]:
    made = Jobs()
    yield made
    made.stop()


class Seen:
    """Collects what is delivered."""

    def __init__(self) -> None:
        self.results: list[object] = []
        self.errors: list[Exception] = []
        self.threads: set[int] = set()

    def done(self, result: object) -> None:
        self.results.append(result)
        self.threads.add(threading.get_ident())

    def failed(self, error: Exception) -> None:
        self.errors.append(error)


def test_work_is_done_elsewhere_and_delivered_here(jobs: Jobs, qtbot) -> None:
    seen, where = Seen(), []

    def work(_run: Run) -> int:
        where.append(threading.get_ident())
        return 7

    jobs.submit("a", work, seen.done, seen.failed)
    assert jobs.busy("a")
    qtbot.waitUntil(lambda: seen.results == [7])
    assert where[0] != threading.get_ident()
    assert seen.threads == {threading.get_ident()}
    assert not jobs.busy("a")


def test_the_newest_wins_and_late_results_are_dropped(jobs: Jobs, qtbot) -> None:
    seen, gate, begun = Seen(), threading.Event(), threading.Event()
    cancelled: list[bool] = []

    def slow(run: Run) -> str:
        begun.set()
        gate.wait(PATIENCE)
        cancelled.append(run.cancelled)
        return "old"

    jobs.submit("a", slow, seen.done, seen.failed)
    assert begun.wait(PATIENCE)
    jobs.submit("a", lambda _run: "waiting", seen.done, seen.failed)
    jobs.submit("a", lambda _run: "new", seen.done, seen.failed)
    gate.set()
    qtbot.waitUntil(lambda: not jobs.busy("a"))
    assert seen.results == ["new"]
    assert cancelled == [True]


def test_an_overtakable_job_that_runs_is_still_seen(jobs: Jobs, qtbot) -> None:
    seen, gate, begun = Seen(), threading.Event(), threading.Event()

    def slow(run: Run) -> str:
        begun.set()
        gate.wait(PATIENCE)
        return "first"

    jobs.submit("a", slow, seen.done, seen.failed, overtakable=True)
    assert begun.wait(PATIENCE)
    jobs.submit("a", lambda _run: "skipped", seen.done, seen.failed, overtakable=True)
    jobs.submit("a", lambda _run: "last", seen.done, seen.failed, overtakable=True)
    gate.set()
    qtbot.waitUntil(lambda: not jobs.busy("a"))
    assert seen.results == ["first", "last"]


def test_a_stream_delivers_each_item_and_lets_others_in_between(jobs: Jobs, qtbot) -> None:
    order: list[object] = []
    gate, finished = threading.Event(), []

    def stream(_run: Run) -> Iterator[int]:
        yield 0
        gate.wait(PATIENCE)
        yield from (1, 2)

    jobs.submit(
        "s", stream, order.append, pytest.fail, priority=5, finished=lambda: finished.append(1)
    )
    jobs.submit("a", lambda _run: "between", order.append, pytest.fail, priority=1)
    gate.set()
    qtbot.waitUntil(lambda: not jobs.busy("s"))
    assert [one for one in order if one != "between"] == [0, 1, 2]
    assert order.index("between") < order.index(2)
    assert finished == [1]


def test_urgent_work_is_done_inside_slow_work(jobs: Jobs, qtbot) -> None:
    order: list[str] = []
    begun, gate = threading.Event(), threading.Event()

    def slow(run: Run) -> str:
        begun.set()
        gate.wait(PATIENCE)
        run.tick(0.5, "half")
        order.append("slow goes on")
        return "slow"

    def urgent(_run: Run) -> str:
        order.append("urgent")
        return "urgent"

    seen = Seen()
    jobs.submit("slow", slow, seen.done, seen.failed, priority=5)
    assert begun.wait(PATIENCE)
    jobs.submit("u", urgent, seen.done, seen.failed, priority=0, urgent=True)
    gate.set()
    qtbot.waitUntil(lambda: not jobs.busy("slow"))
    assert order == ["urgent", "slow goes on"]
    assert seen.results == ["urgent", "slow"]


def test_a_cancelled_job_stops_at_its_next_tick_and_says_nothing(jobs: Jobs, qtbot) -> None:
    seen, begun, stopped = Seen(), threading.Event(), threading.Event()

    def work(run: Run) -> None:
        begun.set()
        try:
            while True:
                run.tick(0.1, "on and on")
        finally:
            stopped.set()

    jobs.submit("a", work, seen.done, seen.failed)
    assert begun.wait(PATIENCE)
    with qtbot.waitSignal(jobs.idled):
        jobs.cancel("a")
    assert stopped.wait(PATIENCE)
    jobs.submit("b", lambda _run: 1, seen.done, seen.failed)
    qtbot.waitUntil(lambda: seen.results == [1])
    assert seen.errors == []


def test_an_engine_error_is_delivered_as_it_is(jobs: Jobs, qtbot) -> None:
    seen = Seen()

    def work(_run: Run) -> None:
        raise EngineError("No.")

    jobs.submit("a", work, seen.done, seen.failed)
    qtbot.waitUntil(lambda: len(seen.errors) == 1)
    assert str(seen.errors[0]) == "No."


def test_a_bug_is_logged_and_does_not_end_the_thread(jobs: Jobs, qtbot, caplog) -> None:
    seen = Seen()
    jobs.submit("a", lambda _run: 1 // 0, seen.done, seen.failed)
    qtbot.waitUntil(lambda: len(seen.errors) == 1)
    assert isinstance(seen.errors[0], ZeroDivisionError)
    assert "channel a failed" in caplog.text
    jobs.submit("a", lambda _run: 2, seen.done, seen.failed)
    qtbot.waitUntil(lambda: seen.results == [2])


def test_progress_is_told_at_most_twenty_times_a_second(
    jobs: Jobs, qtbot, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, told = Seen(), []
    jobs.progressed.connect(lambda *words: told.append(words))
    milliseconds = count(1000)  # each asks for the time once
    clock = SimpleNamespace(monotonic=lambda: 1e-3 * next(milliseconds))
    monkeypatch.setattr(app.jobs, "time", clock)

    def work(run: Run) -> None:
        for i in range(2000):
            run.tick(i / 2000, "working")

    jobs.submit("a", work, seen.done, seen.failed)
    qtbot.waitUntil(lambda: len(seen.results) == 1)
    assert 30 <= len(told) <= 41, "in two seconds"
    assert told[0][0] == "a"


class Endless:
    """A stream that says when it is ended, and in which thread."""

    def __init__(self) -> None:
        self.ended = threading.Event()
        self.thread = 0

    def work(self, _run: Run) -> Iterator[int]:
        try:
            yield from count()
        finally:
            self.thread = threading.get_ident()
            self.ended.set()


@pytest.fixture
def no_collector() -> Iterator[None]:
    """What happens, happens without the garbage collector."""
    gc.disable()
    yield
    gc.enable()


def test_a_stream_cancelled_between_two_items_is_ended_in_the_engine_thread(
    jobs: Jobs, qtbot, no_collector: None
) -> None:
    seen, stream = Seen(), Endless()
    gate, begun = threading.Event(), threading.Event()

    def ahead(_run: Run) -> None:
        begun.set()
        gate.wait(PATIENCE)

    jobs.submit("stream", stream.work, seen.done, seen.failed)
    qtbot.waitUntil(lambda: bool(seen.results))
    jobs.submit("ahead", ahead, seen.done, seen.failed, priority=1)
    assert begun.wait(PATIENCE)
    jobs.cancel("stream")
    assert not stream.ended.is_set()
    gate.set()
    assert stream.ended.wait(PATIENCE)
    assert stream.thread != threading.get_ident()
    qtbot.waitUntil(lambda: not jobs.busy("ahead"))
    assert not seen.errors


def test_a_stream_is_ended_when_the_jobs_stop(qtbot, no_collector: None) -> None:
    seen, stream, jobs = Seen(), Endless(), Jobs()
    jobs.submit("stream", stream.work, seen.done, seen.failed)
    qtbot.waitUntil(lambda: bool(seen.results))
    jobs.stop()
    assert stream.ended.is_set()
    assert stream.thread != threading.get_ident()


def test_a_stream_that_fails_when_it_is_ended_is_logged_and_work_goes_on(
    jobs: Jobs, qtbot, caplog
) -> None:
    seen = Seen()

    def sulky(_run: Run) -> Iterator[int]:
        try:
            yield from count()
        finally:
            raise ValueError("sulking")

    jobs.submit("stream", sulky, seen.done, seen.failed)
    qtbot.waitUntil(lambda: bool(seen.results))
    jobs.cancel("stream")
    jobs.submit("after", lambda _run: "after", seen.done, seen.failed)
    qtbot.waitUntil(lambda: "after" in seen.results)
    assert not seen.errors
    qtbot.waitUntil(lambda: "sulking" in caplog.text)


class Large:
    """What a job is made of, or makes: something that one knows the end of."""


def _at_once(_run: Run) -> Large:
    return Large()


def _streamed(_run: Run) -> Iterator[Large]:
    yield Large()
    yield Large()


def _refused(_run: Run) -> Large:
    raise EngineError("No.")


def _ticking(run: Run) -> Large:
    run.tick(0.5, "half")
    return Large()


@pytest.mark.parametrize("kind", [_at_once, _streamed, _refused, _ticking])
def test_a_job_that_is_over_holds_nothing(jobs: Jobs, qtbot, no_collector: None, kind) -> None:
    given = Large()
    ends = [weakref.ref(given)]

    def work(run: Run, _given: Large = given) -> object:
        return kind(run)

    def done(result: Large) -> None:
        ends.append(weakref.ref(result))

    job = jobs.submit("a", work, done, lambda error: ends.append(weakref.ref(error)))
    ends.append(weakref.ref(job.run))
    del given, work, job
    qtbot.waitUntil(lambda: not jobs.busy("a"))
    assert len(ends) > 2, "it was delivered"
    qtbot.waitUntil(lambda: not any(end() is not None for end in ends))
