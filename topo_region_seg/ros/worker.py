# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A thread that always works on the newest frame; whatever waited longer is dropped and counted."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class NewestWinsWorker(Generic[T]):
    """Run `process` on a thread of its own, one item at a time, with room for one waiting item.

    Parameters
    ----------
    process : callable
        Called with each item; must not raise.
    name : str
        Name of the thread.
    """

    def __init__(self, process: Callable[[T], None], name: str) -> None:
        self._process = process
        self._changed = threading.Condition()
        self._waiting: T | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, item: T) -> bool:
        """Hand over the newest item; return whether it displaced one that had not been started."""
        with self._changed:
            displaced = self._waiting is not None
            self._waiting = item
            self._changed.notify()
        return displaced

    def stop(self, timeout: float | None = None) -> tuple[bool, bool]:
        """Forget the waiting item and wait up to `timeout` seconds for the running one.

        Returns
        -------
        ended, forgot : bool
            Whether the running item ended in time, and whether an item was waiting.
        """
        with self._changed:
            forgot = self._waiting is not None
            self._stopping = True
            self._waiting = None
            self._changed.notify()
        self._thread.join(timeout)
        return not self._thread.is_alive(), forgot

    def _run(self) -> None:
        while (item := self._take()) is not None:
            self._process(item)
            del item  # or it would be kept while the next one is waited for

    def _take(self) -> T | None:
        with self._changed:
            self._changed.wait_for(lambda: self._stopping or self._waiting is not None)
            item, self._waiting = self._waiting, None
            return None if self._stopping else item
