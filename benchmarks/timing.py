# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The stopwatch: warm up, then repeat, and keep the best and the median."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TypeVar

import numpy as np

T = TypeVar("T")

ENOUGH_MS = 8_000.0


@dataclass(frozen=True)
class Timing:
    """Milliseconds of repeated runs."""

    times_ms: tuple[float, ...]

    @property
    def best(self) -> float:
        """Shortest run, ms."""
        return min(self.times_ms)

    @property
    def median(self) -> float:
        """Median run, ms."""
        return median(self.times_ms)

    def quantile(self, share: float) -> float:
        """Return the smallest time that `share` of the runs did not exceed, ms."""
        return float(np.quantile(self.times_ms, share, method="higher"))

    def __add__(self, other: Timing) -> Timing:
        """Return the runs of both."""
        return Timing(self.times_ms + other.times_ms)

    def __str__(self) -> str:
        return f"{self.median:,.1f}"

    def as_dict(self) -> dict[str, float]:
        """Return best, median and number of runs."""
        return {"best_ms": round(self.best, 4), "median_ms": round(self.median, 4), "runs": len(self.times_ms)}


def timed(work: Callable[[], T], repeats: int, warm_up: int = 1) -> tuple[Timing, T]:
    """Run `work` and return the times of `repeats` runs after `warm_up` others, and what the last one returned.

    Runs of several seconds are repeated less often: none is begun after :data:`ENOUGH_MS`.
    """
    for _ in range(warm_up):
        result = work()
    times: list[float] = []
    gc.collect()
    gc.disable()
    try:
        while len(times) < repeats and sum(times) < ENOUGH_MS:
            start = time.perf_counter()
            result = work()
            times.append((time.perf_counter() - start) * 1e3)
    finally:
        gc.enable()
    return Timing(tuple(times)), result


def timing(times_ms: Sequence[float]) -> Timing:
    """Return the timing of runs that another program measured."""
    return Timing(tuple(float(ms) for ms in times_ms))
