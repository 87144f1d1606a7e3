# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The worker thread: newest wins, nothing is lost uncounted, and it stops."""

from __future__ import annotations

import threading

from topo_region_seg.ros.worker import NewestWinsWorker


class Gate:
    """A worker's task that tells when it began and waits to be let through."""

    def __init__(self) -> None:
        self.done: list[int] = []
        self.began = threading.Semaphore(0)
        self.go = threading.Semaphore(0)

    def __call__(self, item: int) -> None:
        self.began.release()
        assert self.go.acquire(timeout=10)
        self.done.append(item)


def test_the_newest_waiting_item_wins_and_displacement_is_told() -> None:
    gate = Gate()
    worker: NewestWinsWorker[int] = NewestWinsWorker(gate, "test")
    assert not worker.submit(0)
    assert gate.began.acquire(timeout=10)
    assert [worker.submit(item) for item in (1, 2, 3)] == [False, True, True]
    gate.go.release(2)
    assert gate.began.acquire(timeout=10)
    assert worker.stop(10) == (True, False)
    assert gate.done == [0, 3]


def test_stop_forgets_what_waits_and_waits_for_what_runs() -> None:
    gate = Gate()
    worker: NewestWinsWorker[int] = NewestWinsWorker(gate, "test")
    worker.submit(0)
    assert gate.began.acquire(timeout=10)
    worker.submit(1)
    assert worker.stop(0.05) == (False, True), "one still running, one forgotten"
    gate.go.release(2)
    assert worker.stop(10) == (True, False)
    assert gate.done == [0]


def test_an_idle_worker_stops() -> None:
    assert NewestWinsWorker(lambda _: None, "test").stop(10) == (True, False)
