"""Cluster: where items are worked on: a local Dask cluster, or one that is already running."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from app.batch.item import Item, Outcome, work
from engine import EngineError

MOST_WORKERS = 256
RETRIES = 3
"""How often an item is tried again when the worker that had it dies."""


@contextmanager
def client(scheduler: str | None, workers: int | None = None) -> Iterator[Any]:
    """Yield a Dask client: of the cluster at `scheduler`, or of a local one, a process per core.

    Raises
    ------
    EngineError
        Dask is not installed, or nothing answers at the address.
    """
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise EngineError(
            "Sweeps and batches run on Dask, which is not installed. "
            "Install it with: pip install 'eigenform[batch]'"
        ) from error
    dask.config.set(
        {
            # A worker opens files in a process of its own, which daemonic processes may not start.
            "distributed.worker.daemon": False,
            "distributed.scheduler.allowed-failures": RETRIES,
        }
    )
    # Its own handlers would write over the progress bar.
    logging.getLogger("distributed").setLevel(logging.ERROR)
    if scheduler is not None:
        try:
            there = Client(scheduler, timeout=10)
        except (OSError, ValueError) as error:
            raise EngineError(
                f"No Dask scheduler answers at {scheduler}. Check the address, or leave out "
                "--scheduler to work on this machine."
            ) from error
        with there:
            yield there
        return
    count = (os.cpu_count() or 1) if workers is None else workers
    if not 1 <= count <= MOST_WORKERS:
        raise EngineError(
            f"{count:,} processes cannot share the work. Give --workers a number from 1 to "
            f"{MOST_WORKERS}, or leave it out for one a core."
        )
    with (
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=logging.ERROR,
        ) as cluster,
        Client(cluster) as here,
    ):
        yield here


def outcomes(dask_client: Any, items: Sequence[Item]) -> Iterator[tuple[Item, Outcome]]:
    """Yield each item with its outcome as they finish; every item comes exactly once.

    An item whose worker dies is done again elsewhere; after `RETRIES` deaths it is given up as
    failed, for it may be the item that kills.
    """
    from distributed import as_completed

    futures = {
        dask_client.submit(work, item, key=f"{item.name}-{item.key[:16]}", retries=RETRIES): item
        for item in items
    }
    for future in as_completed(futures):
        item = futures[future]
        error = future.exception()
        if error is None:
            yield item, future.result()
        else:
            reason = f"The worker was lost while doing it ({type(error).__name__})."
            yield item, Outcome(item.name, None, None, reason, 0.0, 0.0)
        future.release()
