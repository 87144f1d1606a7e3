# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""All topics of the node over DDS, camera, node and listener in processes of their own: each is what replay writes."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from clouds import DRIVERS, TYPES, Driver, message
from interface_builder import robot_interfaces
from ros_harness import Client, Heard, NodeProcess, listening, running_node, until

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.bags.types import VISION_MSGS, typestore
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

KINDS = {output.name: output.kind for output in OUTPUTS}
WITH_INTENSITY = Driver([*DRIVERS["realsense"].fields, ("intensity", 20, 7)], 24)

pytestmark = [pytest.mark.timeout(420), pytest.mark.usefixtures("default_parameters")]


@pytest.fixture(scope="module")
def vision_msgs() -> dict[str, str]:
    """The environment of processes that have vision_msgs."""
    return robot_interfaces()


@pytest.fixture(scope="module")
def node(
    ros_domain: int, tmp_path_factory: pytest.TempPathFactory, vision_msgs: dict[str, str]
) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("node") / "log.txt"
    given = "-p", "pass_fields:=[intensity]"
    with running_node(ros_domain, log, *given, environment=vision_msgs) as process:
        yield process


@pytest.fixture(scope="module")
def heard(ros_domain: int, tmp_path_factory: pytest.TempPathFactory, vision_msgs: dict[str, str]) -> Iterator[Heard]:
    with listening(ros_domain, tmp_path_factory.mktemp("heard"), KINDS, vision_msgs) as heard:
        yield heard


def newest(heard: Heard, name: str) -> Any:
    """Return the last message of a topic, None before the first."""
    found = heard.all(name)
    return typestore().deserialize_cdr(found[-1], KINDS[name]) if found else None


def has(heard: Heard, name: str, stamp: Any) -> bool:
    """Whether the last message of a topic has a stamp, or none at all."""
    message = newest(heard, name)
    if message is None or name == "region_count":
        return message is not None
    header = message.markers[0].header if name == "region_markers" else message.header
    return bool(header.stamp == stamp)


def tabletop_message() -> Any:
    cloud = simulate(tabletop(seed=2), Camera.kinect(160, 120), seed=2).cloud
    return message(cloud.xyz, cloud.rgb, driver=WITH_INTENSITY, height=cloud.height)


def serialized(name: str, made: Any) -> bytes:
    return bytes(typestore().serialize_cdr(made, KINDS[name]))


@pytest.mark.parametrize("output", ["regions", "objects", "supervoxels"])
def test_each_topic_is_made_of_the_segmentation(client: Client, heard: Heard, output: str) -> None:
    assert client.set_parameters({"output": output})[0].successful
    for name in KINDS:
        until(lambda name=name: client.node.count_subscribers(name), f"the listener of {name}")
    msg = tabletop_message()
    heard.forget()

    def answered() -> bool:
        msg.header.stamp.sec += 1
        client.points.publish(bytes(typestore().serialize_cdr(msg, POINT_CLOUD)))
        try:
            return bool(until(lambda: all(has(heard, name, msg.header.stamp) for name in KINDS), "all topics", 3.0))
        except AssertionError:
            return False

    until(answered, "a frame on all topics")
    cloud = decode(msg, max_points=10**6)
    answer = Answer(msg, cloud, Pipeline(Params(output=output)).run(cloud), ("intensity",))
    assert len(answer.seg.regions) >= 2 and answer.seg.plane is not None
    for wanted in OUTPUTS:
        made, came = wanted.make(TYPES, answer), newest(heard, wanted.name)
        assert serialized(wanted.name, came) == serialized(wanted.name, made), wanted.name
    assert [d.id for d in newest(heard, "detections").detections] == [str(r.label) for r in answer.seg.regions]
    assert newest(heard, "surfaces").detections[0].results[0].hypothesis.class_id == "support"
    assert [f.name for f in newest(heard, "foreground_points").fields][-1] == "intensity"


def test_recorded_types_have_the_hash_of_those_that_ros_builds(vision_msgs: dict[str, str]) -> None:
    prefix = Path(vision_msgs["AMENT_PREFIX_PATH"].split(os.pathsep)[0])
    for name in VISION_MSGS:
        description = json.loads((prefix / "share" / "vision_msgs" / "msg" / f"{name}.json").read_text())
        hashes = {entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]}
        kind = f"vision_msgs/msg/{name}"
        assert typestore().hash_rihs01(kind) == hashes[kind]


def test_a_node_with_vision_msgs_says_nothing_of_it(client: Client, node: NodeProcess) -> None:
    assert "vision_msgs" not in node.log
