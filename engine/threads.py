"""Long native calls beside a thread that can still be told to stop.

The engine takes its parallelism from work that is independent (two bands at a time), and keeps
the BLAS below it on one thread: more of them gain nothing there, fight with the window's thread for
the cores, and would make the last bits of a result depend on the machine's load.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import TypeVar

import scipy.linalg  # noqa: F401  (its own BLAS must be loaded before the limit is set)
import threadpoolctl

from engine.errors import Cancelled
from engine.run import Run

A = TypeVar("A")
T = TypeVar("T")

POLL_SECONDS = 0.02

threadpoolctl.threadpool_limits(1, user_api="blas")


def while_polling(run: Run, work: Callable[[], T]) -> T:
    """Return what `work` returns; it goes on unheard when the run is cancelled meanwhile."""
    pool = ThreadPoolExecutor(1, thread_name_prefix="engine")
    try:
        return results(run, [pool.submit(work)])[0]
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def two_at_a_time(run: Run, work: Callable[[A], T], inputs: Iterable[A]) -> Iterator[T]:
    """Yield work(input) for every input in order; while one is awaited the next is under way."""
    pool = ThreadPoolExecutor(2, thread_name_prefix="engine")
    source = iter(inputs)
    jobs = deque(pool.submit(work, given) for given in islice(source, 2))
    try:
        while jobs:
            yield results(run, [jobs.popleft()])[0]
            jobs.extend(pool.submit(work, given) for given in islice(source, 1))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def results(run: Run, jobs: Sequence[Future[T]]) -> list[T]:
    """Return the results of jobs in their order.

    Raises
    ------
    Cancelled
        The run was cancelled; jobs under way end at their next look at `run.cancelled`.
    """
    open_jobs = set(jobs)
    while open_jobs:
        _, open_jobs = wait(open_jobs, timeout=POLL_SECONDS)
        if run.cancelled:
            raise Cancelled
    return [job.result() for job in jobs]
