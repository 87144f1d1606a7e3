# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How much several threads gain: measured at as many as there are cores, and what to expect of more.

``python -m benchmarks.speedup`` prints, for every output, the wall time of one thread divided by that of two where
there are two cores, and what a schedule gives that is made of the CPU times of all tasks: those of a run that cuts its
work for so many threads, but does it with one. Such a schedule knows of no memory that threads have to share, nor of
the time that it takes to wake them.
"""

from __future__ import annotations

import argparse
import heapq
import time
from collections.abc import Sequence
from dataclasses import replace
from statistics import median

import topo_region_seg as trs
from benchmarks import recordings
from benchmarks.report import table
from topo_region_seg.compiled.threads import cores, recorded
from topo_region_seg.pipeline import warm_up

EXPECTED = (2, 4, 8, 16)
REPEATS = 9
OUTPUTS: dict[str, trs.Params] = {
    "regions": trs.Params(),
    "fixed radius": trs.Params(max_radius=0.02),
    "objects": trs.Params(output="objects"),
    "supervoxels": trs.Params(output="supervoxels"),
}


def scheduled(total: float, groups: Sequence[Sequence[float]], workers: int) -> float:
    """Return the seconds that work takes of which `groups` of tasks are shared out, each in order, the rest is not."""
    rest = total - sum(map(sum, groups))
    return rest + sum(span(tasks, workers) for tasks in groups)


def span(tasks: Sequence[float], workers: int) -> float:
    """Return the seconds until all tasks are done, each begun in order by the first worker who is free."""
    free = [0.0] * workers
    for seconds in tasks:
        heapq.heappush(free, heapq.heappop(free) + seconds)
    return max(free)


def measured(cloud: trs.Cloud, params: trs.Params, repeats: int) -> float:
    """Return the median time of one thread divided by that of two, in turns."""
    pipelines = [trs.Pipeline(replace(params, threads=count)) for count in (1, 2)]
    times: list[list[float]] = [[], []]
    for _ in range(repeats):
        for pipeline, found in zip(pipelines, times, strict=True):
            start = time.perf_counter()
            pipeline.run(cloud, _heard)
            found.append(time.perf_counter() - start)
    return median(times[0]) / median(times[1])


def expected(cloud: trs.Cloud, params: trs.Params, workers: int, repeats: int) -> float:
    """Return what so many workers gain by a schedule; of some runs the median."""
    pipeline, gains = trs.Pipeline(replace(params, threads=workers)), list[float]()
    for _ in range(repeats):
        with recorded() as groups:
            start = time.thread_time()
            pipeline.run(cloud, _heard)
            total = time.thread_time() - start
        gains.append(total / scheduled(total, groups, workers))
    return median(gains)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser("python -m benchmarks.speedup", description=__doc__)
    parser.add_argument("--repeats", type=int, default=REPEATS, help="runs of each (%(default)s)")
    repeats = parser.parse_args(arguments).repeats
    warm_up()
    cloud = recordings.frames()[0].cloud()
    rows = []
    for output, params in OUTPUTS.items():
        gain = f"{measured(cloud, params, repeats):.2f}" if cores() > 1 else "one core"
        rows.append([output, gain, *(f"{expected(cloud, params, workers, repeats):.2f}" for workers in EXPECTED)])
    print(table(["output", "measured, 2 threads", *(f"expected, {workers}" for workers in EXPECTED)], rows))


def _heard(code: str, text: str) -> None:
    """Take a notice: what the frame is like is no concern here."""


if __name__ == "__main__":
    main()
