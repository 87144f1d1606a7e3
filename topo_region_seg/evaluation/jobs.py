# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Many recordings, each with many sets of parameters, in this process or on a cluster."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from topo_region_seg.bags.records import BagError
from topo_region_seg.evaluation.results import BagResult, merged
from topo_region_seg.evaluation.run import evaluate, tasks_of
from topo_region_seg.evaluation.source import Source, Task
from topo_region_seg.params import Params

Step = Callable[[], None]
Stopped = Callable[[], bool]
Runner = Callable[[Sequence[Task], Step, Stopped], Iterator[tuple[int, BagResult]]]
"""Does tasks, until it is told to stop: yields the place of each in the sequence and its result, as they are done."""


@dataclass(frozen=True)
class Job:
    """One recording with one set of parameters."""

    source: Source
    params: Params


@dataclass(frozen=True)
class Done:
    """The result of the job at `place` of the sequence; not `complete` if the work was stopped before its end."""

    place: int
    result: BagResult
    complete: bool = True


def in_this_process(tasks: Sequence[Task], step: Step, stopped: Stopped) -> Iterator[tuple[int, BagResult]]:
    """Do tasks one after the other; the :data:`Runner` that needs no cluster."""
    for place, task in enumerate(tasks):
        if stopped():
            return
        yield place, evaluate(task, step, stopped)


def run_jobs(jobs: Sequence[Job], runner: Runner, step: Step, stopped: Stopped) -> Iterator[Done]:
    """Do all jobs; yields the result of each as soon as its last part is there.

    Parameters
    ----------
    jobs : sequence of Job
        What to do; the results do not depend on their order, nor on the runner.
    runner : callable
        Who does it.
    step : callable
        Called for every cloud that is done.
    stopped : callable
        Once it says true, what is done is yielded, and nothing more is begun.
    """
    tasks: list[Task] = []
    owner: list[int] = []
    parts: dict[int, list[BagResult | None]] = {}
    planned: dict[Source, list[Task]] = {}
    for place, job in enumerate(jobs):
        try:
            if job.source not in planned:
                planned[job.source] = tasks_of(job.source, job.params)
        except BagError as error:
            yield Done(place, BagResult(job.source.bag, error=str(error)))
            continue
        own = [dataclasses.replace(task, params=job.params) for task in planned[job.source]]
        parts[place] = [None] * len(own)
        tasks += own
        owner += [place] * len(own)
    first = {place: owner.index(place) for place in parts}
    for number, result in runner(tasks, step, stopped):
        place = owner[number]
        parts[place][number - first[place]] = result
        whole = [part for part in parts[place] if part is not None]
        if len(whole) == len(parts[place]) and not stopped():
            del parts[place]
            yield Done(place, merged(whole))
    for place, some in parts.items():
        if any(some):
            yield Done(place, merged([part for part in some if part is not None]), complete=False)
