# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Work beside the main thread, in order and bounded: one thread reads ahead, another finishes what is behind."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

T = TypeVar("T")

_END: Any = object()


@contextmanager
def read_ahead(items: Iterator[T], depth: int) -> Iterator[Iterator[T]]:
    """Take items from an iterator in a thread, at most `depth` before they are asked for.

    They come in order; an error of the iterator is raised where its item would have come. The thread has ended when
    the context has, and the iterator is only ever touched by that thread.
    """
    with ThreadPoolExecutor(1, "reader") as thread:
        waiting = deque(thread.submit(next, items, _END) for _ in range(depth))

        def taken() -> Iterator[T]:
            while (item := waiting.popleft().result()) is not _END:
                waiting.append(thread.submit(next, items, _END))
                yield item

        try:
            yield taken()
        finally:
            thread.shutdown(wait=False, cancel_futures=True)


@contextmanager
def finish_behind(depth: int) -> Iterator[Callable[[Callable[[], None]], None]]:
    """Give a function that has work done in a thread: in order, with at most `depth` pieces not done yet.

    It waits while there are more. An error of the work is raised at one of the next calls, or at the end of the
    context, and the work after it is left out. The end waits for all work, unless an error ends the context.
    """
    with ThreadPoolExecutor(1, "writer") as thread:
        waiting: deque[Future[None]] = deque()

        def submit(work: Callable[[], None]) -> None:
            while len(waiting) >= depth:
                waiting.popleft().result()
            waiting.append(thread.submit(work))

        try:
            yield submit
            while waiting:
                waiting.popleft().result()
        finally:
            thread.shutdown(wait=False, cancel_futures=True)
