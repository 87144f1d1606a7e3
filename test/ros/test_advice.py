# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a silent node advises: cameras, durability, shared memory; and never another node's output."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import clouds
import pytest
from places import ROOT, SIMULATED

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_harness import Client, NodeProcess, cloud_message, running_node, until
from sensor_msgs.msg import PointCloud2

SHORT = ("-p", "input_timeout:=1.0")
WANTED = ("-r", "labeled_points:=/labeled_points")
"""The client subscribes there: a node whose results nobody wants does not miss clouds."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def client(ros_domain: int) -> Iterator[Client]:
    client = Client(ros_domain + 50)
    yield client
    client.close()


@pytest.fixture
def start(ros_domain: int, tmp_path: Path) -> Iterator[Callable[..., NodeProcess]]:
    with ExitStack() as nodes:
        yield lambda name, *args: nodes.enter_context(
            running_node(ros_domain + 50, tmp_path / f"{name}.txt", "-r", f"__ns:=/{name}", *SHORT, *args)
        )


def advice(node: NodeProcess) -> str:
    node.wait_for_log("no clouds on")
    return [line for line in node.log.splitlines() if "no clouds on" in line][-1]


def test_a_camera_is_named_and_outputs_of_other_nodes_are_not(
    client: Client, start: Callable[..., NodeProcess]
) -> None:
    camera = client.node.create_publisher(PointCloud2, "/zed/cloud", 1)
    recorded = client.node.create_publisher(PointCloud2, "/recorded/labeled_points", 1)
    # One with its own names for its topics, one with the usual ones.
    renamed = start("a", "-r", "labeled_points:=/a/result", "-r", "points:=/zed/cloud", "-r", "barcode:=/a/bars")
    renamed.wait_for_log("active: waiting")
    start("b", "-r", "points:=/zed/cloud").wait_for_log("active: waiting")
    silent = start("c")
    # At first the graph may not be known in full.
    silent.wait_for_log("remap with --ros-args -r points:=/points or -r points:=/zed/cloud")
    assert advice(silent).endswith("remap with --ros-args -r points:=/points or -r points:=/zed/cloud")
    client.node.destroy_publisher(camera)
    client.node.destroy_publisher(recorded)


def test_a_publisher_that_says_nothing_is_named_with_its_node_and_shared_memory(
    client: Client, start: Callable[..., NodeProcess]
) -> None:
    node = start("d", "-r", "points:=/points", *WANTED)
    node.wait_for_log("although /client publishes there")
    assert "--ipc=host" in advice(node) and "/dev/shm" in advice(node), "same host, Fast DDS, nothing heard yet"
    node.wait_for_log("active: waiting")
    until(client.points.get_subscription_count, "the subscription")
    client.points.publish(cloud_message(*clouds.scene(), height=48))
    node.wait_for_log("clouds are coming in")
    until(lambda: "no clouds on" in node.log.rpartition("clouds are coming in")[2], "silence again")
    assert "--ipc=host" not in advice(node), "what was heard once comes through"


def test_what_was_latched_before_the_start_is_answered_and_its_silence_is_no_error(
    client: Client, start: Callable[..., NodeProcess]
) -> None:
    latched = client.node.create_publisher(PointCloud2, "/map/cloud", LATCHED)
    latched.publish(cloud_message(*clouds.scene(), height=48))
    node = start("e", "-r", "points:=/map/cloud", *WANTED)
    node.wait_for_log("first cloud answered")
    mark = len(client.diagnostics)
    until(lambda: len(client.diagnostics) > mark + 3, "reports")
    assert client.diagnostics[-1].status[0].level == b"\x00", client.diagnostics[-1].status[0].message
    # A live camera on the same topic is heard as well.
    live = client.node.create_publisher(PointCloud2, "/map/cloud", 1)
    until(live.get_subscription_count, "the subscription to become volatile")
    before = int(client.figures()["clouds processed"])

    def answered() -> bool:
        live.publish(cloud_message(*clouds.scene(), height=48))
        return int(client.figures()["clouds processed"]) > before

    until(answered, "an answer to the camera")
    client.node.destroy_publisher(live)
    client.node.destroy_publisher(latched)


def test_durability_is_named_where_it_is_held_by_an_override(client: Client, start: Callable[..., NodeProcess]) -> None:
    latched = client.node.create_publisher(PointCloud2, "/map/cloud", LATCHED)
    latched.publish(cloud_message(*clouds.scene(), height=48))
    name = "qos_overrides./map/cloud.subscription.durability"
    node = start("f", "-r", "points:=/map/cloud", "-p", f"{name}:=volatile")
    node.wait_for_log(f"its durability asks for -p {name}:=transient_local")
    client.node.destroy_publisher(latched)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, for a /dev/shm that only the player sees")
def test_shared_memory_that_is_not_shared_is_named_by_both(ros_domain: int, start: Callable[..., NodeProcess]) -> None:
    if subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode:
        pytest.skip("unshare -m is not permitted here")
    node = start("g", "-r", "points:=/points")
    node.wait_for_log("active: waiting")
    script = 'mount -t tmpfs -o size=300m tmpfs /dev/shm && exec "$@"'
    play = [sys.executable, "-m", "topo_region_seg", "play", str(SIMULATED), "--hz", "5", "--wait-timeout", "20"]
    done = subprocess.run(
        ["unshare", "-m", "sh", "-c", script, "sh", *play],
        env={**os.environ, "ROS_DOMAIN_ID": str(ros_domain + 50), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=90,
    )
    assert done.returncode == 1
    assert "--ipc=host" in done.stderr and "/dev/shm" in done.stderr
    heard = [line for line in node.log.splitlines() if "publishes there" in line]
    assert heard and all("--ipc=host" in line and "/dev/shm" in line for line in heard), "until the player went"
    assert "first cloud" not in node.log
