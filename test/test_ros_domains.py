# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Test runs side by side have ROS domains of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack

import pytest
from places import TEST
from ros_domains import BASES, NEIGHBOR, free_domain

HOLD = "import ros_domains, sys\nwith ros_domains.free_domain() as d:\n    print(d, flush=True)\n    sys.stdin.read()"


def test_runs_side_by_side_share_none() -> None:
    environment = os.environ | {"PYTHONPATH": os.fspath(TEST)}
    with ExitStack() as runs:
        processes = [
            runs.enter_context(
                subprocess.Popen(
                    [sys.executable, "-c", HOLD],
                    env=environment,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            for _ in range(4)
        ]
        bases = [int(process.stdout.readline()) for process in processes if process.stdout]
        taken = {base + offset for base in bases for offset in (0, NEIGHBOR, NEIGHBOR + 1)}
        assert len(taken) == 3 * len(processes)
        # One that is killed holds nothing.
        processes[0].kill()
        processes[0].wait()
        with ExitStack() as rest:
            free = set()
            try:
                while True:
                    free.add(rest.enter_context(free_domain()))
            except RuntimeError:
                pass
            assert bases[0] in free
            assert not free & set(bases[1:])


@pytest.mark.parametrize("discovery", ["SUBNET", "LOCALHOST"])
def test_a_domain_with_other_nodes_is_left_to_them(discovery: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rclpy = pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", discovery)
    with free_domain() as first:
        pass
    context = rclpy.context.Context()
    rclpy.init(context=context, domain_id=first)
    node = rclpy.create_node("other", context=context)
    try:
        with free_domain() as second:
            assert second in BASES and second != first
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
        context.destroy()
