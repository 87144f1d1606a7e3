# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How long each stage takes: on the wall's clock, and in CPU time of the threads that work at it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

_HELPED = threading.local()


def cpu_seconds() -> float:
    """Return the CPU seconds of this thread so far, with those of threads that helped it.

    Unlike the time of the process they leave out what other threads do meanwhile, such as reading and writing.
    """
    return time.thread_time() + getattr(_HELPED, "seconds", 0.0)


def credit_help(seconds: float) -> None:
    """Count CPU seconds that another thread spent for this one."""
    _HELPED.seconds = getattr(_HELPED, "seconds", 0.0) + seconds


class Clock:
    """Milliseconds per stage, and CPU milliseconds, in order, beginning with some that are known."""

    def __init__(self, ms: Mapping[str, float] | None = None, cpu_ms: Mapping[str, float] | None = None) -> None:
        self.ms: dict[str, float] = dict(ms or {})
        self.cpu_ms: dict[str, float] = dict(cpu_ms or {})

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time what is done inside, in one thread and those that help it; what comes in two parts adds up."""
        start, spent = time.perf_counter(), cpu_seconds()
        yield
        self.cpu_ms[stage] = self.cpu_ms.get(stage, 0.0) + (cpu_seconds() - spent) * 1e3
        self.ms[stage] = self.ms.get(stage, 0.0) + (time.perf_counter() - start) * 1e3
