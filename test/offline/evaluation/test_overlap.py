# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Reading ahead and finishing behind: order, bounds, errors, and no thread left."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from topo_region_seg.offline.cli.overlap import finish_behind, read_ahead

WAIT = 30.0


@pytest.fixture(autouse=True)
def _no_thread_is_left() -> Iterator[None]:
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


def test_items_come_in_order_from_one_other_thread() -> None:
    threads = set()

    def items() -> Iterator[int]:
        for number in range(50):
            threads.add(threading.get_ident())
            yield number

    with read_ahead(items(), 2) as ahead:
        assert list(ahead) == list(range(50))
    assert len(threads) == 1 and threading.get_ident() not in threads


def test_no_more_is_read_ahead_than_asked_for() -> None:
    started: list[int] = []
    reached = threading.Event()

    def items() -> Iterator[int]:
        for number in range(20):
            started.append(number)
            if number == 3:
                reached.set()
            yield number

    with read_ahead(items(), 3) as ahead:
        assert next(ahead) == 0
        assert reached.wait(WAIT)  # the fourth is read while nobody asks for it
        assert max(started) == 3
    assert max(started) == 3  # and no more after the end


def test_an_error_of_the_reader_comes_after_the_items_before_it() -> None:
    def items() -> Iterator[int]:
        yield 1
        yield 2
        raise KeyError("third")

    seen = []
    with pytest.raises(KeyError, match="third"), read_ahead(items(), 2) as ahead:
        for item in ahead:
            seen.append(item)
    assert seen == [1, 2]


def test_work_is_done_in_order_and_all_of_it() -> None:
    done: list[int] = []
    with finish_behind(2) as finish:
        for number in range(50):
            finish(lambda number=number: done.append(number))  # type: ignore[misc]
    assert done == list(range(50))


def test_no_more_work_waits_than_allowed() -> None:
    go, both = threading.Event(), threading.Event()
    submitted: list[int] = []

    def wait() -> None:
        go.wait(WAIT)

    def submit_three() -> None:
        with finish_behind(2) as finish:
            for number in range(3):
                finish(wait)
                submitted.append(number)
                if number == 1:
                    both.set()

    thread = threading.Thread(target=submit_three)
    thread.start()
    assert both.wait(WAIT)
    assert submitted == [0, 1]  # the third waits for the first
    go.set()
    thread.join(WAIT)
    assert submitted == [0, 1, 2]


def test_an_error_of_the_work_ends_it() -> None:
    done: list[int] = []

    def work(number: int) -> None:
        if number == 2:
            raise OSError("full")
        done.append(number)

    with pytest.raises(OSError, match="full"), finish_behind(1) as finish:
        for number in range(10):
            finish(lambda number=number: work(number))  # type: ignore[misc]
    assert done == [0, 1]


def test_an_error_of_the_last_work_is_not_lost() -> None:
    def work() -> None:
        raise OSError("full")

    with pytest.raises(OSError, match="full"), finish_behind(5) as finish:
        finish(work)


def test_work_that_waits_is_left_out_when_the_context_fails() -> None:
    go = threading.Event()
    done: list[int] = []

    def fail() -> None:
        with finish_behind(5) as finish:
            finish(lambda: done.append(0) if go.wait(WAIT) else None)
            for number in range(1, 4):
                finish(lambda number=number: done.append(number))  # type: ignore[misc]
            threading.Timer(0.05, go.set).start()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert done in ([0], [])
