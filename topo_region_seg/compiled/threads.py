# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Kernels side by side: they release the GIL, so plain threads will do.

All callers share one pool. Who calls works too, and does alone what helpers have not begun: a busy pool delays nobody.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

from topo_region_seg.clock import credit_help

T = TypeVar("T")
MOST = 8
"""Threads for one cloud, unless more are asked for: what is done one after the other then takes most of the time."""
PARTS = 4
"""Parts for each thread, as some take longer."""

_LOCAL = threading.local()


def cores() -> int:
    """Return how many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def threads() -> int:
    """Return how many threads work for the calling one, itself included."""
    limit: int = getattr(_LOCAL, "limit", 0) or min(cores(), MOST)
    # What is recorded is cut for threads that there are elsewhere.
    return limit if getattr(_LOCAL, "record", None) is not None else min(limit, _pool_size() + 1)


@contextmanager
def at_most(limit: int) -> Iterator[None]:
    """Let so many threads work at what is done inside by the calling thread; 0: as many as cores, at most `MOST`."""
    before = getattr(_LOCAL, "limit", 0)
    _LOCAL.limit = limit
    try:
        yield
    finally:
        _LOCAL.limit = before


@contextmanager
def recorded() -> Iterator[list[list[float]]]:
    """Let the calling thread do alone what is done inside; yields the CPU seconds of all tasks, call by call."""
    record: list[list[float]] = []
    _LOCAL.record = record
    try:
        yield record
    finally:
        _LOCAL.record = None


def side_by_side(function: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> list[T]:
    """Call `function` with each tuple of arguments, in this thread and helping ones; return the results in order."""
    waiting = deque(enumerate(tasks))
    results: dict[int, T] = {}
    record: list[list[float]] | None = getattr(_LOCAL, "record", None)
    if record is not None:
        record.append([])

    def work(note: Callable[[float], None] | None = None) -> float:
        start = before = time.thread_time()
        while True:
            try:
                place, task = waiting.popleft()
            except IndexError:
                return time.thread_time() - start
            results[place] = function(*task)
            if note is not None:
                before, after = time.thread_time(), before
                note(before - after)

    if record is not None:
        work(record[-1].append)
        return [results[place] for place in range(len(tasks))]
    helpers = [_pool().submit(work) for _ in range(min(threads(), len(tasks)) - 1)]
    try:
        work()
    finally:
        # After an error nothing more is begun.
        waiting.clear()
        # Helpers that are busy for another caller, or were lost in a fork, have not begun, and nothing is left to do.
        for helper in helpers:
            if not helper.cancel():
                credit_help(helper.result())
    return [results[place] for place in range(len(tasks))]


def in_parts(n: int, parts: int = 0) -> list[tuple[int, int]]:
    """Cut range(n) into consecutive parts, at least one; unless `parts` are given, more than there are threads."""
    parts = parts or PARTS * max(threads(), 2)
    bounds = [n * part // parts for part in range(parts + 1)]
    return [(first, end) for first, end in pairwise(bounds) if first < end] or [(0, 0)]


def _pool_size() -> int:
    return max(cores(), MOST) - 1


@cache
def _pool() -> ThreadPoolExecutor:
    # Kept, as to start a thread takes longer than many a piece of work; it starts as many as are needed.
    return ThreadPoolExecutor(_pool_size(), thread_name_prefix="kernels")
