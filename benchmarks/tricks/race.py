# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Forms of the kernels against each other: each in a process of its own, in turns, by processor time.

Kernels are compiled once in a process, so that each form needs its own. They take turns, as the pace of a machine
changes from one minute to the next.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from benchmarks.child import MARK, ROOT

ROUNDS = 15
LEAST_SECONDS = 0.15
"""Time of a round of a stage: shorter ones are repeated within it."""


class Racer:
    """A form of the kernels, waiting in a process for its turns."""

    def __init__(self, form: str, constants: Mapping[str, float], stages: Sequence[str], by_clock: bool) -> None:
        self.form, self.stages = form, stages
        task = json.dumps({"form": form, "constants": constants, "stages": list(stages), "by_clock": by_clock})
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.tricks.racer", task],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ready(self) -> None:
        """Wait until all is compiled."""
        self._answer()

    def run(self, stage: str) -> float:
        """Return the time of a stage, ms."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{stage}\n")
        self._process.stdin.flush()
        return float(self._answer())

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait(timeout=60.0)

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(MARK):
                return json.loads(line.removeprefix(MARK))
        raise RuntimeError(f"the process with the form '{self.form}' ended early, see above")


@contextlib.contextmanager
def racers(
    tasks: Sequence[tuple[str, Mapping[str, float]]], stages: Sequence[str], by_clock: bool = False
) -> Iterator[list[Racer]]:
    """Start a process for each form and its constants; end them all at the end."""
    started = [Racer(form, constants, stages, by_clock) for form, constants in tasks]
    try:
        for racer in started:
            racer.ready()
        yield started
    finally:
        for racer in started:
            racer.close()


def best_times(
    tasks: Sequence[tuple[str, Mapping[str, float]]], stages: Sequence[str], *, by_clock: bool = False
) -> list[dict[str, float]]:
    """Return for each form the least time of each stage, ms: of all processors together, or by the clock."""
    with racers(tasks, stages, by_clock) as started:
        return [{stage: min(times) for stage, times in found.items()} for found in _turns(started, stages, ROUNDS)]


def _turns(started: Sequence[Racer], stages: Sequence[str], rounds: int) -> list[dict[str, list[float]]]:
    found: list[dict[str, list[float]]] = [{stage: [] for stage in stages} for _ in started]
    for _ in range(rounds):
        for stage in stages:
            for racer, times in zip(started, found, strict=True):
                times[stage].append(racer.run(stage))
    return found


def least_ms(work: Callable[[], Any], repeats: int, *, by_clock: bool) -> float:
    """Return the least time of several calls, ms: of all processors together, or by the clock."""
    now = time.perf_counter if by_clock else time.process_time
    times = []
    for _ in range(repeats):
        begun = now()
        work()
        times.append(now() - begun)
    return 1e3 * min(times)
