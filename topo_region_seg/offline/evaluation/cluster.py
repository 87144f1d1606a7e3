# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tasks on a Dask cluster: several local processes, or a running cluster."""

from __future__ import annotations

import asyncio
import logging
import queue
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from topo_region_seg.offline.evaluation.jobs import Runner, Step, Stopped
from topo_region_seg.offline.evaluation.results import BagResult
from topo_region_seg.offline.evaluation.run import evaluate
from topo_region_seg.offline.evaluation.source import Task

CONNECT_TIMEOUT = 15.0
"""Seconds to wait for a scheduler and for its first worker."""
_POLL = 0.2  # seconds between two checks for a stop request


class ClusterError(Exception):
    """There is no cluster to work on; the message is one line with the reason and how to fix it."""


@contextmanager
def dask_runner(workers: int | None = None, scheduler: str | None = None) -> Iterator[Runner]:
    """Provide a runner on a cluster: one of `workers` processes on this machine, or that of `scheduler`.

    When a worker dies, the scheduler gives its task to another one. A task that kills several workers is abandoned, and
    its result says so.

    Raises
    ------
    ClusterError
        Dask is not installed, or the scheduler does not answer or has no workers.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise ClusterError(
            f"--workers and --scheduler need Dask ({error}); run pip install '.[dask]', or leave them out"
        ) from None
    # Dask restarts workers that die; what it cannot repair is in the result.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        if scheduler is None:
            # The pipeline has threads of its own. Dask's default memory limit is the share of a single core.
            local = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
            scheduler = stack.enter_context(local).scheduler_address
        try:
            client = stack.enter_context(Client(scheduler, timeout=CONNECT_TIMEOUT, set_as_default=False))
            client.wait_for_workers(1, timeout=CONNECT_TIMEOUT)
        except (OSError, ValueError, asyncio.TimeoutError) as error:
            reason = " ".join(str(error).split())
            raise ClusterError(
                f"--scheduler {scheduler}: no scheduler with workers there ({reason}); "
                "start them with 'dask scheduler' and 'dask worker'"
            ) from None
        yield lambda tasks, step, stopped: _run(client, tasks, step, stopped)


def _run(client: Any, tasks: Sequence[Task], step: Step, stopped: Stopped) -> Iterator[tuple[int, BagResult]]:
    done: queue.SimpleQueue[int] = queue.SimpleQueue()
    futures: dict[int, Any] = {}
    for place, task in enumerate(tasks):
        futures[place] = client.submit(evaluate, task, pure=False)
        futures[place].add_done_callback(lambda _, place=place: done.put(place))
    while futures:
        if stopped():
            client.cancel(list(futures.values()))
            return
        try:
            place = done.get(timeout=_POLL)
        except queue.Empty:
            continue
        result = _result(futures.pop(place), tasks[place])
        for _ in range(len(result.frames) + result.without_truth):
            step()
        yield place, result


def _result(future: Any, task: Task) -> BagResult:
    try:
        result: BagResult = future.result()
    except Exception as error:  # any error of a worker; the other tasks go on
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        return BagResult(task.source.bag, error=f"{task.source.bag}: failed on the cluster ({reason})")
    return result
