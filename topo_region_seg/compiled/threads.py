# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Kernels side by side: they release the GIL, so plain threads will do."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

T = TypeVar("T")
WORKERS = 2


def side_by_side(function: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> list[T]:
    """Call `function` with each tuple of arguments, in this thread and a helping one; return the results in order."""
    waiting = deque(enumerate(tasks))
    results: dict[int, T] = {}

    def work() -> None:
        while True:
            try:
                place, task = waiting.popleft()
            except IndexError:
                return
            results[place] = function(*task)

    help_given = _helper().submit(work)
    work()
    # A helper that is busy for another caller, or was lost in a fork, has not begun, and nothing is left to do.
    if not help_given.cancel():
        help_given.result()
    return [results[place] for place in range(len(tasks))]


def in_parts(n: int, parts: int = 4 * WORKERS) -> list[tuple[int, int]]:
    """Cut range(n) into consecutive parts, at least one; more than there are workers, as some take longer."""
    bounds = [n * part // parts for part in range(parts + 1)]
    return [(first, end) for first, end in pairwise(bounds) if first < end] or [(0, 0)]


@cache
def _helper() -> ThreadPoolExecutor:
    # Kept, as to start a thread takes longer than many a piece of work.
    return ThreadPoolExecutor(WORKERS - 1, thread_name_prefix="kernels")
