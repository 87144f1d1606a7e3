# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Schedules of recorded tasks, by hand."""

from __future__ import annotations

import pytest

from benchmarks.speedup import scheduled, span


@pytest.mark.parametrize(
    ("tasks", "workers", "seconds"),
    [([], 4, 0.0), ([3.0], 4, 3.0), ([1.0, 2.0, 3.0], 1, 6.0), ([1.0, 2.0, 3.0], 2, 4.0), ([3.0, 2.0, 1.0], 2, 3.0),
     ([1.0] * 8, 4, 2.0), ([1.0] * 9, 4, 3.0)],
)  # fmt: skip
def test_tasks_are_begun_in_order_by_who_is_free(tasks: list[float], workers: int, seconds: float) -> None:
    assert span(tasks, workers) == seconds


def test_what_is_no_task_is_done_by_one() -> None:
    groups = [[1.0, 1.0], [2.0, 1.0, 1.0]]
    assert scheduled(10.0, groups, 1) == 10.0
    assert scheduled(10.0, groups, 2) == 4.0 + 1.0 + 2.0
