# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""CPU time of the whole pipeline in both revisions, measured in turns."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from revision_comparison.configurations import TIMED, Configuration
from revision_comparison.revisions import RevisionError, Worker

ROUNDS = 7
"""Pairs of new processes. On a busy machine, medians of two processes with the same sources differed by up to 8 %
however many runs each had; their median over several pairs did not."""


@dataclass
class Timing:
    """CPU milliseconds of one configuration a cloud, one entry for each round."""

    name: str
    base_ms: list[float] = field(default_factory=list)
    present_ms: list[float] = field(default_factory=list)

    def line(self) -> str:
        """Return what is printed: medians over the rounds, of the change too, as a round has one load for both."""
        before, now = statistics.median(self.base_ms), statistics.median(self.present_ms)
        changes = [100 * (b / a - 1) for a, b in zip(self.base_ms, self.present_ms, strict=True)]
        return (
            f"{self.name}: {before:.1f} ms before, {now:.1f} ms now, {statistics.median(changes):+.1f} % "
            f"(single rounds {min(changes):+.1f} to {max(changes):+.1f} %)"
        )


def measure(trees: tuple[Path, Path], clouds: list[Path], runs: int) -> Iterator[list[Timing]]:
    """Yield what is known after each round: every configuration, and their sum."""
    timings = [Timing(configuration.name) for configuration in TIMED]
    total = Timing("all")
    for number in range(ROUNDS):
        with Worker(trees[0]) as base, Worker(trees[1]) as present:
            # What runs first must not always be the same.
            workers = [base, present] if number % 2 else [present, base]
            for timing, configuration in zip(timings, TIMED, strict=True):
                medians = _medians(workers, configuration, clouds, runs)
                timing.base_ms.append(medians[workers.index(base)])
                timing.present_ms.append(medians[workers.index(present)])
        total.base_ms.append(sum(timing.base_ms[-1] for timing in timings))
        total.present_ms.append(sum(timing.present_ms[-1] for timing in timings))
        yield [*timings, total]


def _medians(workers: list[Worker], configuration: Configuration, clouds: list[Path], runs: int) -> list[float]:
    """Return the milliseconds a cloud of each worker: the mean over the clouds of the medians of their runs."""
    medians: list[list[float]] = [[] for _ in workers]
    for cloud in clouds:
        request: dict[str, Any] = {"do": "segment", "cloud": str(cloud), "params": configuration.params}
        spent = [[_seconds(worker, request) for worker in workers] for _ in range(runs + 1)]
        # The first run loads what the others find loaded.
        for found, column in zip(medians, zip(*spent[1:], strict=True), strict=True):
            found.append(1e3 * statistics.median(column))
    return [statistics.mean(found) for found in medians]


def _seconds(worker: Worker, request: dict[str, Any]) -> float:
    answer = worker.ask(request)
    if "error" in answer:
        raise RevisionError(f"{worker.tree}: {request['params']}: {answer['error']}")
    return float(answer["cpu"])
