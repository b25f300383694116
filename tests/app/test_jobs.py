"""The engine thread: order, newest wins, streams, urgent work in between, cancel, errors."""

from __future__ import annotations

import threading
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
