# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Work beside the main thread, in order and bounded: one thread reads ahead, another finishes the results."""

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
    """Take items from an iterator in a thread, up to `depth` items ahead.

    They come in order; an error of the iterator is raised in place of its item. Only that thread touches the iterator,
    and it ends with the context.
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
    """Provide a function that runs work in a thread, in order.

    The function waits while more than `depth` pieces of work are pending. An error is raised by one of the next calls
    or at the end of the context, and the work that follows it is dropped. The context ends when all work is done, or at
    once if an error ends it.
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
