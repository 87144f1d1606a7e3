# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Evaluation on a Dask cluster of separate processes finds what this process does, also when a worker is killed."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="Dask is not installed: pip install '.[dask]'")

from distributed import Client, LocalCluster

from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation import run
from topo_region_seg.offline.evaluation.cluster import dask_runner
from topo_region_seg.offline.evaluation.jobs import Job, Plan, in_this_process
from topo_region_seg.offline.evaluation.results import BagResult
from topo_region_seg.offline.evaluation.source import Source
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import write_recording
from topo_region_seg.params import Params

BAGS, FRAMES = 5, 4
PARAMS = Params(normal_radius=0.02, max_radius=0.04, min_region_size=16)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags")
    for number in range(BAGS):
        found = [simulate(tabletop(number), Camera.kinect(160, 120), seed) for seed in range(FRAMES)]
        write_recording(folder / f"{number}.mcap", [(frame.cloud, frame.labels) for frame in found])
    return folder


@pytest.fixture(scope="module")
def cluster(warm_kernels: None) -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        memory_limit=0,
        silence_logs=50,
    ) as cluster:
        yield cluster


def plan(folder: Path) -> Plan:
    return Plan([Job(Source(path.name, str(path)), PARAMS) for path in sorted(folder.iterdir())])


def never() -> bool:
    return False


def step() -> None:
    pass


def comparable(results: dict[int, BagResult]) -> list[dict]:
    """Everything but times, in the order of the jobs."""
    found = [results[place].as_dict() for place in sorted(results)]
    for result in found:
        for frame in result["frames"]:
            assert frame.pop("ms")["total"] > 0
    return found


@pytest.fixture(scope="module")
def wanted(folder: Path) -> list[dict]:
    found = comparable({done.place: done.result for done in plan(folder).run(in_this_process, step, never)})
    assert [len(result["frames"]) for result in found] == [FRAMES] * BAGS
    return found


def kill_a_busy_worker(client: Client) -> int:
    """Kill a worker that has work, while it is stopped so that it cannot finish that first; 0 if none has."""
    for address, pid in client.run(os.getpid).items():
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.1)  # for what it has sent
        if client.processing().get(address):
            os.kill(pid, signal.SIGKILL)
            return pid
        os.kill(pid, signal.SIGCONT)
    return 0


def test_a_worker_that_is_killed_costs_a_retry_not_the_run(cluster, folder, wanted, monkeypatch) -> None:
    monkeypatch.setattr(run, "FRAMES_A_TASK", 1)  # so that there is much to do when it happens
    found: dict[int, BagResult] = {}
    killed, before = 0, set()
    with (
        Client(cluster.scheduler_address, set_as_default=False) as client,
        dask_runner(scheduler=cluster.scheduler_address) as runner,
    ):
        before = set(client.run(os.getpid).values())
        for done in plan(folder).run(runner, step, never):
            found[done.place] = done.result
            killed = killed or kill_a_busy_worker(client)
    assert killed in before
    with pytest.raises(ProcessLookupError):
        os.kill(killed, 0)
    assert comparable(found) == wanted


def test_the_command_line_on_a_running_cluster(cluster, folder, wanted, tmp_path) -> None:
    settings = [f"--set={name}={getattr(PARAMS, name)}" for name in ("normal_radius", "max_radius", "min_region_size")]
    with Client(cluster.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(1)
    arguments = ["evaluate", str(folder), "--scheduler", cluster.scheduler_address, "--json", str(tmp_path / "a.json")]
    assert main([*arguments, *settings]) == 0
    frames = json.loads((tmp_path / "a.json").read_text())["frames"]
    expected = [frame["measures"] for result in wanted for frame in result["frames"]]
    assert [{name: frame[name] for name in expected[0]} for frame in frames] == expected


def test_a_cluster_of_its_own(folder, wanted, warm_kernels) -> None:
    steps: list[int] = []
    with dask_runner(workers=1) as runner:
        found = {done.place: done.result for done in plan(folder).run(runner, lambda: steps.append(1), never)}
    assert comparable(found) == wanted
    assert len(steps) == BAGS * FRAMES


def test_what_a_cluster_cannot_do_is_in_the_result(cluster, folder) -> None:
    class Unpicklable(Params):
        def __reduce__(self) -> tuple:
            return exec, ("raise RuntimeError('cannot be made on the worker')",)

    job = Job(Source("0.mcap", str(folder / "0.mcap")), Unpicklable())
    with dask_runner(scheduler=cluster.scheduler_address) as runner:
        (done,) = Plan([job]).run(runner, step, never)
    assert done.result.error.startswith("0.mcap: failed on the cluster (")


def test_a_worker_with_another_version_says_so(folder) -> None:
    (task,) = run.tasks_of(Source("0.mcap", str(folder / "0.mcap")), PARAMS)
    object.__setattr__(task, "version", "0.0.1+other")
    assert "install the same version on all machines" in run.evaluate(task).error


def test_stopping_leaves_what_is_done(cluster, folder) -> None:
    found: list[int] = []
    with dask_runner(scheduler=cluster.scheduler_address) as runner:
        for done in plan(folder).run(runner, step, lambda: bool(found)):
            if done.complete:
                found.append(done.place)
    assert len(found) == 1
    assert list(plan(folder).run(in_this_process, step, lambda: True)) == []
