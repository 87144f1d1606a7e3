# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The programs in examples/ are short, and do what they say."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import clouds
import numpy as np
import pytest
from places import ROOT, SIMULATED

from topo_region_seg import Params, Pipeline, oriented_boxes
from topo_region_seg.cloud.files import read_cloud, write_labeled_cloud
from topo_region_seg.data import Cloud

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MOST_LINES = 40


def run(name: str, *arguments: str | Path) -> str:
    command = [sys.executable, str(ROOT / "examples" / name), *map(str, arguments)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=150, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_they_are_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def test_there_is_a_test_for_each() -> None:
    named = set(re.findall(r"\"(\w+\.py)\"", Path(__file__).read_text(encoding="utf-8")))
    assert named == {path.name for path in EXAMPLES}


def test_a_file_is_segmented(tmp_path: Path, warm_kernels: None) -> None:
    xyz, rgb = clouds.scene(64, 48)
    cloud = Cloud(xyz, rgb, 48, 64)
    write_labeled_cloud(tmp_path / "in.ply", cloud, np.zeros(len(xyz), np.uint32))
    lines = run("segment_file.py", tmp_path / "in.ply", tmp_path / "out.pcd").splitlines()
    regions = int(re.findall(r"(\d+) regions at a scale of \d+", lines[0])[0])
    assert regions >= 2  # two walls
    assert sum("points around" in line for line in lines) == min(regions, 5)
    assert len(read_cloud(tmp_path / "out.pcd", max_points=10_000)) == len(xyz)


def test_the_merge_tree_counts_two_patches_and_then_one(warm_kernels: None) -> None:
    text = run("merge_tree.py")
    # The points are 1.5 mm apart, the patches 7, and a step is 2: so are the answers, whoever computes them.
    assert "1 component at 0.02 m" in text
    assert "meet at 7.0 mm" in text
    assert "steps: 2 2 2 1 1 1 1 1 1 1" in text
    assert "two components up to 7.0 mm" in text
    points = int(text.split()[0])
    assert [int(n) for n in re.findall(r"cut at .*: (\d+) components", text)] == [points, 2, 1]


def test_a_recording_gives_objects_that_keep_their_labels(warm_kernels: None) -> None:
    lines = run("bag_to_objects.py", SIMULATED).splitlines()
    assert len(lines) == 6
    labels = [set(re.findall(r"(\d+): \d+", line.partition("points): ")[2])) for line in lines]
    counts = [int(n) for line in lines for n in re.findall(r"(\d+) objects", line)]
    assert [len(one) for one in labels] == counts and min(counts) > 1
    lasting = set.intersection(*labels)
    assert len(lasting) > min(counts) / 2, "most objects are seen all the time"


@contextmanager
def example(
    name: str, domain: int, log_file: Path, environment: dict[str, str] | None = None
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a node; what it logs goes to a file."""
    command = [sys.executable, "-u", str(ROOT / "examples" / name)]
    env = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": str(ROOT), **(environment or {})}
    with log_file.open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, env=env)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_subscriber_reads_what_the_node_publishes(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    import ros_harness

    domain = request.getfixturevalue("ros_domain") + 50
    xyz, rgb = clouds.scene(64, 48)
    log = tmp_path / "subscriber.log"
    with (
        ros_harness.running_node(domain, tmp_path / "node.log"),
        example("labeled_subscriber.py", domain, log) as process,
    ):
        client = ros_harness.Client(domain)
        try:
            client.wait_for_node()
            # The node may answer before it knows the subscriber.
            for _ in range(20):
                labels = ros_harness.label_column(client.ask(ros_harness.cloud_message(xyz, rgb, 48)))
                with suppress(AssertionError):
                    ros_harness.until(lambda: "regions;" in log.read_text(), "a line of the example", 1.0)
                    break
        finally:
            client.close()
        process.send_signal(signal.SIGINT)
        assert process.wait(ros_harness.PATIENCE) == 0, log.read_text()
    assert f"{labels.max()} regions; {np.count_nonzero(labels == 1)} points around [" in log.read_text()
    assert "Traceback" not in log.read_text()


def test_masks_of_a_detector_get_the_labels_that_they_cover(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    import array

    import ros_harness
    from sensor_msgs.msg import Image

    domain = request.getfixturevalue("ros_domain") + 50
    xyz, rgb = clouds.scene(64, 48)
    msg, log = ros_harness.cloud_message(xyz, rgb, 48), tmp_path / "named.log"
    masks = np.zeros((48, 64), np.uint8)
    masks[10:40, 5:30], masks[10:40, 40:60] = 3, 7
    image = Image(height=48, width=64, encoding="mono8", step=64, data=array.array("B", masks.tobytes()))
    with ros_harness.running_node(domain, tmp_path / "node.log"), example("named_regions.py", domain, log):
        client = ros_harness.Client(domain)
        try:
            publisher = client.node.create_publisher(Image, "masks", 10)
            client.wait_for_node()
            ros_harness.until(publisher.get_subscription_count, "the example")
            labels = ros_harness.label_column(client.ask(msg)).reshape(48, 64)
            for stamp in range(100, 120):
                image.header.stamp.sec = msg.header.stamp.sec = stamp
                publisher.publish(image)
                client.points.publish(msg)
                with suppress(AssertionError):
                    ros_harness.until(lambda: "instance 7" in log.read_text(), "two lines of the example", 1.0)
                    break
        finally:
            client.close()
    for instance, pixel in ((3, (20, 15)), (7, (20, 50))):
        share = np.mean(labels[masks == instance] == labels[pixel])
        assert f"instance {instance}: label {labels[pixel]}, {share:.0%} of its pixels" in log.read_text()


@pytest.mark.timeout(420)
def test_detections_become_collision_objects_and_go_again(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    import ros_harness
    from interface_builder import ROBOT, robot_interfaces
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    environment, store = robot_interfaces(), get_typestore(Stores.ROS2_JAZZY)
    for package, interfaces in ROBOT.items():
        for name, text in interfaces.messages.items():
            store.register(get_types_from_msg(text, f"{package}/msg/{name}"))
    domain = request.getfixturevalue("ros_domain") + 50
    xyz, rgb = clouds.scene(64, 48)
    kind, log = "moveit_msgs/msg/CollisionObject", tmp_path / "collision.log"
    with (
        ros_harness.running_node(domain, tmp_path / "node.log", environment=environment),
        example("collision_objects.py", domain, log, environment),
        ros_harness.listening(domain, tmp_path, {"collision_object": kind}, environment) as heard,
    ):

        def things() -> list[Any]:
            return [store.deserialize_cdr(data, kind) for data in heard.all("collision_object")]

        client = ros_harness.Client(domain)
        try:
            client.wait_for_node()
            ros_harness.until(lambda: client.node.count_subscribers("detections"), "the example")
            seen = ros_harness.cloud_message(xyz, rgb, 48)
            ros_harness.until(lambda: client.ask(seen) and len(things()) >= 2, "boxes")
            gone = ros_harness.cloud_message(np.full_like(xyz, np.nan), rgb, 48)
            ros_harness.until(lambda: client.ask(gone) and things()[-1].operation == 1, "their removal")
        finally:
            client.close()
    boxes = oriented_boxes(Pipeline(Params()).run(Cloud(xyz, rgb, 48, 64)))
    there = {thing.id: thing for thing in things() if thing.operation == 0}
    assert set(there) == {thing.id for thing in things() if thing.operation == 1}
    assert sorted(there) == sorted(f"object_{label}" for label in boxes.label)
    for row, label in enumerate(boxes.label):
        thing = there[f"object_{label}"]
        (shape,) = thing.primitives
        position = thing.pose.position
        assert (shape.type, thing.header.frame_id) == (1, "camera_depth_optical_frame")
        np.testing.assert_array_equal(shape.dimensions, np.maximum(boxes.size[row], 0.001))
        np.testing.assert_array_equal([position.x, position.y, position.z], boxes.center[row])
    assert "Traceback" not in log.read_text()
