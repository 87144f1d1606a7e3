# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Work side by side: whoever does it, results are the same, all of it is counted, and errors come out."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import topo_region_seg as trs
from topo_region_seg.clock import Clock, cpu_seconds
from topo_region_seg.compiled import kd_tree
from topo_region_seg.compiled.threads import MOST, at_most, cores, in_parts, recorded, side_by_side, threads
from topo_region_seg.offline import simulation
from topo_region_seg.steps.filtration import persistence

COUNTS = (1, 2, 3, 4, 8)


@pytest.fixture
def spent(monkeypatch: pytest.MonkeyPatch) -> threading.local:
    """CPU seconds of each thread, which only go on where a test says so."""
    local = threading.local()
    monkeypatch.setattr(time, "thread_time", lambda: getattr(local, "seconds", 0.0))
    return local


def test_the_work_of_helpers_counts_for_who_called(spent: threading.local) -> None:
    everybody = threading.Barrier(3)

    def work(number: int) -> int:
        if number < 3:
            everybody.wait(60)  # so that three threads are at it
        spent.seconds = getattr(spent, "seconds", 0.0) + 1.0
        return number

    clock, before = Clock({"given": 1.0}, {"given": 2.0}), cpu_seconds()
    for stage in ("one", "two", "one"):
        with clock(stage), at_most(3):
            assert side_by_side(work, [(number,) for number in range(10)]) == list(range(10))
            everybody.reset()
    assert clock.cpu_ms == pytest.approx({"given": 2.0, "one": 20_000.0, "two": 10_000.0})
    assert list(clock.ms) == ["given", "one", "two"]
    assert cpu_seconds() == pytest.approx(before + 30.0)
    # Another thread that was not helped has spent nothing.
    with ThreadPoolExecutor(1) as other:
        assert other.submit(cpu_seconds).result() == 0.0


@pytest.mark.parametrize("limit", COUNTS)
def test_no_more_threads_than_asked_for_or_than_work(limit: int) -> None:
    def work(_: int) -> str:
        time.sleep(0.001)
        return threading.current_thread().name

    with at_most(limit):
        assert threads() == limit
        assert len(set(side_by_side(work, [(i,) for i in range(20)]))) <= limit
        assert side_by_side(work, [(0,)]) == [threading.current_thread().name]
        with at_most(1):
            assert set(side_by_side(work, [(i,) for i in range(4)])) == {threading.current_thread().name}
        assert threads() == limit
    assert threads() == min(cores(), MOST)


def test_one_pool_serves_callers_that_come_together() -> None:
    def caller(base: int) -> list[int]:
        with at_most(4):
            return side_by_side(lambda number: base + number, [(number,) for number in range(200)])

    with ThreadPoolExecutor(6) as callers:
        assert list(callers.map(caller, range(0, 6000, 1000))) == [
            list(range(base, base + 200)) for base in range(0, 6000, 1000)
        ]
    assert sum(thread.name.startswith("kernels") for thread in threading.enumerate()) <= max(cores(), MOST) - 1


def test_an_error_ends_the_work_and_comes_out() -> None:
    begun: list[int] = []

    def work(number: int) -> None:
        begun.append(number)
        if number == 3:
            raise ValueError("three")

    for limit in (1, 4):
        begun.clear()
        with at_most(limit), pytest.raises(ValueError, match="three"):
            side_by_side(work, [(number,) for number in range(10_000)])
        assert limit > 1 or begun == [0, 1, 2, 3]
    assert side_by_side(str, [(1,), (2,)]) == ["1", "2"]


def test_what_is_recorded_is_every_task(spent: threading.local) -> None:
    def work(seconds: float) -> float:
        spent.seconds = getattr(spent, "seconds", 0.0) + seconds
        return seconds

    with at_most(8), recorded() as record:
        assert side_by_side(work, [(1.0,), (2.0,), (4.0,)]) == [1.0, 2.0, 4.0]
        assert side_by_side(work, []) == []
        assert side_by_side(work, [(0.5,)]) == [0.5]
    assert record == [[1.0, 2.0, 4.0], [], [0.5]]
    side_by_side(work, [(1.0,)])
    assert len(record) == 3


@pytest.mark.parametrize(("n", "parts"), [(0, 0), (1, 0), (7, 3), (100, 0), (100, 8)])
def test_parts_are_all_of_a_range(n: int, parts: int) -> None:
    found = in_parts(n, parts)
    assert [number for first, end in found for number in range(first, end)] == list(range(n))
    assert len(found) <= max(parts or 4 * max(threads(), 2), 1)


@pytest.fixture
def small_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have even small clouds shared out among all threads."""
    monkeypatch.setattr(kd_tree, "FEWEST", 64)
    monkeypatch.setattr(persistence, "POINTS_FOR_MORE", 50)
    monkeypatch.setattr(persistence, "PAIRS_FOR_MORE", 10)


@pytest.mark.parametrize(
    "given",
    [{}, {"max_radius": "auto"}, {"output": "objects"}, {"output": "supervoxels"}, {"features": "normals"}],
    ids=str,
)
@pytest.mark.usefixtures("small_work")
def test_results_do_not_depend_on_the_threads(given: dict[str, str]) -> None:
    cloud = simulation.simulate(simulation.tabletop(3), simulation.Camera.kinect(160, 120), seed=3).cloud
    one, *others = (trs.Pipeline(trs.Params(threads=count, **given)).run(cloud) for count in COUNTS)
    assert len(one.regions) > 2
    for other in others:
        np.testing.assert_array_equal(one.labels, other.labels)
        np.testing.assert_array_equal(one.features.normals, other.features.normals)
        for name in ("root", "parent", "death"):
            np.testing.assert_array_equal(getattr(one.components, name), getattr(other.components, name))
        half = one.components.max_radius / 2
        np.testing.assert_array_equal(one.cut(half).labels, other.cut(half).labels)


@pytest.mark.usefixtures("small_work")
def test_a_volume_does_not_depend_on_the_threads_either() -> None:
    """So many pairs wait in it that the small scales are joined first."""
    rng = np.random.default_rng(0)
    xyz = rng.uniform(-0.02, 0.02, (4_000, 3)) + [0.0, 0.0, 1.0]
    rgb = rng.integers(100, 104, xyz.shape).astype(np.uint8)
    given = {"features": "color", "max_radius": 0.02, "voxel_size": 0.0, "remove_floor": False}
    one, *others = (trs.segment(xyz, rgb, trs.Params(threads=count, **given)) for count in COUNTS)
    for other in others:
        np.testing.assert_array_equal(one.components.death, other.components.death)
        np.testing.assert_array_equal(one.components.parent, other.components.parent)
