# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Jobs in parts: all clouds once, results whole or said not to be, whatever the order in which parts finish."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from bag_maker import cloud_entries, write_mcap

from topo_region_seg.offline.evaluation import run
from topo_region_seg.offline.evaluation.jobs import Done, Job, Plan, in_this_process
from topo_region_seg.offline.evaluation.results import BagResult, merged
from topo_region_seg.offline.evaluation.run import tasks_of
from topo_region_seg.offline.evaluation.source import Source, Task
from topo_region_seg.offline.frames import Rejection
from topo_region_seg.params import Params


@pytest.fixture
def source(tmp_path: Path) -> Source:
    return Source("a", str(write_mcap(tmp_path / "a.mcap", cloud_entries(7))))


@pytest.mark.parametrize(("size", "most"), [(1, 100), (2, 100), (3, 2), (7, 100), (100, 100)])
def test_the_tasks_of_a_recording_are_all_its_clouds_once(
    size: int, most: int, source: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "FRAMES_A_TASK", size)
    monkeypatch.setattr(run, "MOST_TASKS", most)
    tasks = tasks_of(source, Params())
    assert len(tasks) == min(-(-7 // size), most)
    assert [task.first for task in tasks] == [0, *(task.end for task in tasks[:-1])]
    assert tasks[-1].end is None and sum(task.clouds for task in tasks) == 7
    assert max(task.clouds for task in tasks) - min(task.clouds for task in tasks) <= 1
    assert len(tasks_of(source, Params(track_regions=True))) == 1, "tracking needs all clouds in order"


def stub(task: Task) -> BagResult:
    """What a task might find: a rejection for each of its clouds."""
    rejected = [Rejection(float(number), "why", "detail") for number in range(task.first, task.first + task.clouds)]
    return BagResult(task.source.bag, "/points", f"truth of {task.first}", rejected=rejected, without_truth=1)


@pytest.mark.parametrize("order", itertools.permutations(range(3)))
@pytest.mark.parametrize("finished", range(4))
def test_a_job_is_complete_when_all_of_its_parts_are(
    order: tuple[int, ...], finished: int, source: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "FRAMES_A_TASK", 3)

    def runner(tasks: Sequence[Task], step: object, stopped: object) -> Iterator[tuple[int, BagResult]]:
        for number in order[:finished]:
            yield number, stub(tasks[number])

    found = list(Plan([Job(source, Params())]).run(runner, lambda: None, lambda: False))
    if not finished:
        assert found == []
        return
    tasks = tasks_of(source, Params())
    wanted = merged([stub(tasks[number]) for number in sorted(order[:finished])])
    assert found == [Done(0, wanted, complete=finished == 3)]
    assert [rejection.stamp for rejection in wanted.rejected] == sorted(r.stamp for r in wanted.rejected)
    assert wanted.without_truth == finished and wanted.truth == f"truth of {tasks[min(order[:finished])].first}"


def test_what_was_stopped_is_not_complete_even_where_its_last_part_came(source: Source) -> None:
    plan = Plan([Job(source, Params())])

    def runner(tasks: Sequence[Task], step: object, stopped: object) -> Iterator[tuple[int, BagResult]]:
        yield 0, stub(tasks[0])

    (done,) = plan.run(runner, lambda: None, lambda: True)
    assert not done.complete
    assert list(in_this_process(tasks_of(source, Params()), lambda: None, lambda: True)) == []


def test_recordings_that_cannot_be_opened_fail_and_the_others_are_run(source: Source, tmp_path: Path) -> None:
    jobs = [Job(Source("gone", str(tmp_path / "gone.mcap")), Params()), Job(source, Params()), Job(source, Params())]
    plan = Plan(jobs)
    assert [(done.place, done.result.bag) for done in plan.failed] == [(0, "gone")]
    assert "no such file" in plan.failed[0].result.error and plan.clouds == 14

    def runner(tasks: Sequence[Task], step: object, stopped: object) -> Iterator[tuple[int, BagResult]]:
        yield from ((number, stub(task)) for number, task in enumerate(tasks))

    assert [done.place for done in plan.run(runner, lambda: None, lambda: False)] == [1, 2]


def test_parts_add_up_and_damage_that_all_find_is_said_once() -> None:
    parts = [
        BagResult("a", "/p", "/t", without_truth=2, repeated=1, problems=["x"], notices={"c": "first"}),
        BagResult("a", "/p", "/t", without_truth=3, repeated=2, problems=["x", "y"], notices={"c": "second", "d": "e"}),
        BagResult("a", "/p", "/t", truncated=True, error="why"),
    ]
    whole = merged(parts)
    assert (whole.without_truth, whole.repeated, whole.problems, whole.truncated) == (5, 3, ["x", "y"], True)
    assert (whole.notices, whole.error) == ({"c": "first", "d": "e"}, "why")
    assert not merged(parts[:1]).error, "damage says enough"
    nothing = merged([BagResult("a", "/p", "/t", without_truth=2)] * 2)
    assert nothing.error.startswith("a: none of its 4 clouds has truth in /t")
