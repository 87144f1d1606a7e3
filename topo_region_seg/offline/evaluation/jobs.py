# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Many recordings with many sets of parameters, in this process or on a cluster."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.evaluation.results import BagResult, merged
from topo_region_seg.offline.evaluation.run import evaluate, tasks_of
from topo_region_seg.offline.evaluation.source import Source, Task
from topo_region_seg.params import Params

Step = Callable[[], None]
Stopped = Callable[[], bool]
Runner = Callable[[Sequence[Task], Step, Stopped], Iterator[tuple[int, BagResult]]]
"""Runs tasks until asked to stop; yields the place of each in the sequence with its result, as they finish."""


@dataclass(frozen=True)
class Job:
    """One recording with one set of parameters."""

    source: Source
    params: Params


@dataclass(frozen=True)
class Done:
    """The result of the job at `place` in the sequence; not `complete` if it was stopped before its end."""

    place: int
    result: BagResult
    complete: bool = True


def in_this_process(tasks: Sequence[Task], step: Step, stopped: Stopped) -> Iterator[tuple[int, BagResult]]:
    """Run tasks one after the other: the :data:`Runner` that needs no cluster."""
    for place, task in enumerate(tasks):
        if stopped():
            return
        yield place, evaluate(task, step, stopped)


class Plan:
    """The tasks that jobs are made of.

    Parameters
    ----------
    jobs : sequence of Job
        The jobs; their order does not affect the results.

    Attributes
    ----------
    clouds : int
        Number of clouds in all jobs.
    failed : list of Done
        Jobs whose recording cannot be opened or has no such clouds.
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        self.failed: list[Done] = []
        self._tasks: list[Task] = []
        self._owner: list[tuple[int, int]] = []  # job and part of each task
        self._parts: dict[int, list[BagResult | None]] = {}
        known: dict[tuple[Source, bool], list[Task] | str] = {}
        for place, job in enumerate(jobs):
            key = job.source, job.params.track_regions
            found = known.get(key) or known.setdefault(key, _tasks_or_error(job))
            if isinstance(found, str):
                self.failed.append(Done(place, BagResult(job.source.bag, error=found)))
                continue
            self._tasks += [dataclasses.replace(task, params=job.params) for task in found]
            self._owner += [(place, part) for part in range(len(found))]
            self._parts[place] = [None] * len(found)
        self.clouds = sum(task.clouds for task in self._tasks)

    def run(self, runner: Runner, step: Step, stopped: Stopped) -> Iterator[Done]:
        """Run all tasks; yields the result of each job as soon as its last part is finished.

        Parameters
        ----------
        runner : callable
            Where the tasks run; it does not affect the results.
        step : callable
            Called for every cloud that is finished.
        stopped : callable
            Once it returns true, no further work is started, and what is finished is yielded.
        """
        parts = self._parts
        for number, result in runner(self._tasks, step, stopped):
            place, part = self._owner[number]
            parts[place][part] = result
            found = [part for part in parts[place] if part is not None]
            if len(found) == len(parts[place]) and not stopped():
                del parts[place]
                yield Done(place, merged(found))
        for place, some in parts.items():
            if any(some):
                yield Done(place, merged([part for part in some if part is not None]), complete=False)


def _tasks_or_error(job: Job) -> list[Task] | str:
    try:
        return tasks_of(job.source, job.params)
    except BagError as error:
        return str(error)
