# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Jobs whose results are kept, so that interrupted work continues where it stopped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.evaluation.cache import Key, ResultCache, key_of
from topo_region_seg.offline.evaluation.finding import content_id
from topo_region_seg.offline.evaluation.jobs import Done, Job, Plan, Runner, Step, Stopped
from topo_region_seg.offline.evaluation.results import BagResult
from topo_region_seg.offline.evaluation.version import program_version
from topo_region_seg.offline.frames import INTERNAL_ERROR


class Sweep:
    """Jobs, with their results from the cache where there are any.

    Parameters
    ----------
    jobs : sequence of Job
        The jobs.
    cache : ResultCache
        Where results are kept.

    Attributes
    ----------
    results : dict of int to BagResult
        Results so far, by the place of the job in `jobs`.
    cached, computed : int
        How many of them came from the cache, and how many were computed.
    clouds : int
        Number of clouds that remain to be processed.
    """

    def __init__(self, jobs: Sequence[Job], cache: ResultCache) -> None:
        self.results: dict[int, BagResult] = {}
        self.computed = 0
        self._cache = cache
        self._keys: dict[int, Key] = {}
        contents: dict[str, str] = {}
        for place, job in enumerate(jobs):
            key = _key(job, contents)
            if key is None:
                continue  # it cannot be read; the plan reports it
            self._keys[place] = key
            known = cache.get(key, job.source.bag)
            if known is not None:
                self.results[place] = known
        self.cached = len(self.results)
        self._rest = [place for place in range(len(jobs)) if place not in self.results]
        self._plan = Plan([jobs[place] for place in self._rest])
        self.clouds = self._plan.clouds
        for done in self._plan.failed:
            self.results[self._rest[done.place]] = done.result

    def run(self, runner: Runner, step: Step, stopped: Stopped, warn: Callable[[str], None]) -> None:
        """Compute the remaining results, keeping each one as soon as it is finished.

        Parameters
        ----------
        runner, step, stopped
            See :meth:`~topo_region_seg.offline.evaluation.jobs.Plan.run`.
        warn : callable
            Called with a text, once, if results cannot be kept.
        """
        writable = True
        for done in self._plan.run(runner, step, stopped):
            if not done.complete:
                continue
            place = self._rest[done.place]
            self.results[place] = done.result
            self.computed += 1
            if writable and _lasts(done):
                try:
                    self._cache.put(self._keys[place], done.result)
                except OSError as error:
                    writable = False
                    warn(f"{self._cache.folder}: results cannot be kept ({error.strerror}); choose another --cache")


def _key(job: Job, contents: dict[str, str]) -> Key | None:
    """Return the key of a job's result; None if the recording cannot be read. `contents` caches identifiers by path."""
    paths = [job.source.path, *([job.source.truth_bag] if job.source.truth_bag else [])]
    try:
        for path in paths:
            if path not in contents:
                contents[path] = content_id(Path(path))
    except BagError:
        return None
    truth = contents[paths[1]] if len(paths) > 1 else ""
    return key_of(contents[paths[0]], truth, job.source, job.params, program_version())


def _lasts(done: Done) -> bool:
    """Whether another run would give the same result: chance failures are tried again."""
    result = done.result
    return not result.error and all(rejection.reason != INTERNAL_ERROR for rejection in result.rejected)
