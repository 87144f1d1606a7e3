# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Several cameras in one process over real DDS: each has its topics, tracks, figures and service."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from lifecycle_msgs.msg import Transition
from ros_harness import STARTUP, Client, NodeProcess, cloud_message, label_column, running_node, until
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import UInt32
from std_srvs.srv import Trigger

from topo_region_seg.ros.node import WRONG_USAGE

CAMERAS = ("left", "right")


@dataclass
class Side:
    """What the test has of a camera: where it publishes, and what comes back."""

    points: Any
    labeled: list[Any]
    counts: list[Any]

    def ask(self, msg: PointCloud2, sec: int) -> PointCloud2:
        """Publish until there is an answer: a cloud may be lost while others discover each other."""
        for _ in range(5):
            msg.header.stamp.sec = sec
            self.points.publish(msg)
            try:
                return until(lambda: next((m for m in self.labeled if m.header.stamp.sec == sec), None), "labels", 5.0)
            except AssertionError:
                continue
        raise AssertionError("no labels for any of 5 clouds")


@pytest.fixture(scope="module")
def node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("node") / "log.txt"
    names = f"cameras:=[{', '.join(CAMERAS)}]"
    with running_node(
        ros_domain, log, "-p", names, "-p", "track_regions:=true", "-p", "warning_period:=0.0"
    ) as process:
        yield process


@pytest.fixture(scope="module")
def listener(ros_domain: int, node: NodeProcess) -> Iterator[Client]:
    client = Client(ros_domain, labels=False)
    node.wait_for_log("active: waiting")
    yield client
    client.close()


@pytest.fixture(scope="module")
def sides(listener: Client) -> dict[str, Side]:
    found = {name: subscribed(listener, name) for name in CAMERAS}
    for side in found.values():
        until(side.points.get_subscription_count, "a subscription to the clouds", STARTUP)
    return found


def subscribed(client: Client, name: str) -> Side:
    points = client.node.create_publisher(PointCloud2, f"{name}/points", 10)
    counts = client.collect(UInt32, f"{name}/region_count")
    return Side(points, client.collect(PointCloud2, f"{name}/labeled_points"), counts)


def squares(count: int, side: int = 24) -> PointCloud2:
    """Return a row of squares, each of another color, 0.1 m apart in depth; the first is the largest."""
    x, y = (0.004 * grid.ravel() for grid in np.meshgrid(np.arange(count * side), np.arange(side)))
    number = (x / (0.004 * side)).astype(int)
    xyz = np.column_stack([x - 0.1, y, 0.8 + 0.1 * number]).astype(np.float32)
    rgb = np.array([[200, 30, 30], [30, 30, 200], [30, 200, 30], [200, 200, 30]], np.uint8)[number]
    return cloud_message(xyz, rgb, height=side)


def figures(client: Client, name: str) -> dict[str, str]:
    """Return the values of the newest diagnostics of a camera; none where there were none yet."""
    for report in reversed(client.diagnostics):
        if report.status[0].name == f"region_segmentation/{name}: segmentation":
            return {item.key: item.value for item in report.status[0].values}
    return {}


def test_each_camera_is_answered_on_its_own_topics(sides: dict[str, Side]) -> None:
    left = sides["left"].ask(squares(3), 11)
    right = sides["right"].ask(squares(2), 12)
    assert set(np.unique(label_column(left))) == {1, 2, 3}
    assert set(np.unique(label_column(right))) == {1, 2}
    until(lambda: sides["left"].counts and sides["right"].counts, "counts")
    assert {count.data for count in sides["left"].counts} == {3}
    assert {count.data for count in sides["right"].counts} == {2}
    assert {msg.header.stamp.sec for msg in sides["left"].labeled} == {11}


def test_labels_last_for_each_camera_by_itself(sides: dict[str, Side]) -> None:
    """A stream that goes back in time is a new one, but the other camera's time is none of its own."""
    before = label_column(sides["right"].ask(squares(2), 100))
    sides["left"].ask(squares(3), 50)
    after = label_column(sides["right"].ask(squares(2), 101))
    assert np.array_equal(before, after)
    assert label_column(sides["left"].ask(squares(3), 51)).max() >= 3


def test_each_has_its_own_figures(sides: dict[str, Side], listener: Client) -> None:
    torn = squares(2)
    torn.data = torn.data[:-7]
    sides["left"].points.publish(torn)
    until(lambda: figures(listener, "left").get("rejected: data_too_short") == "1", "the rejected cloud")
    for name, rejected in (("left", 1), ("right", 0)):
        counts = {
            what: int(figures(listener, name)[f"clouds {what}"]) for what in ("received", "processed", "rejected")
        }
        assert counts["rejected"] == rejected
        assert counts["received"] == counts["processed"] + rejected == len(sides[name].labeled) + rejected


def test_the_log_names_the_camera(node: NodeProcess) -> None:
    assert "active: waiting for clouds on /left/points, /right/points" in node.log
    assert "[region_segmentation.left]: [data_too_short]" in node.log


def test_each_has_its_own_service(sides: dict[str, Side], listener: Client) -> None:
    listener.set_parameters({"request_timeout": 20.0})
    answers: list[Any] = []
    client = listener.node.create_client(Trigger, "/region_segmentation/right/segment_once")
    assert client.wait_for_service(20.0)
    client.call_async(Trigger.Request()).add_done_callback(lambda future: answers.append(future.result()))

    def served() -> bool:
        sides["right"].ask(squares(2), 200 + len(sides["right"].labeled))
        return bool(answers)

    until(served, "an answer of the service")
    assert answers[0].success and "2 regions" in answers[0].message


def test_other_cameras_are_taken_when_the_node_is_configured_anew(sides: dict[str, Side], listener: Client) -> None:
    assert listener.set_parameters({"cameras": ["1st"]})[0].reason.startswith("cameras: '1st' is no name for topics")
    assert listener.set_parameters({"cameras": ["right", "rear"]})[0].successful
    for transition in ("DEACTIVATE", "CLEANUP", "CONFIGURE", "ACTIVATE"):
        assert listener.change_state(getattr(Transition, f"TRANSITION_{transition}"))
    rear = subscribed(listener, "rear")
    until(rear.points.get_subscription_count, "a subscription to the clouds")
    assert set(np.unique(label_column(rear.ask(squares(4), 301)))) == {1, 2, 3, 4}
    assert sides["left"].points.get_subscription_count() == 0
    listener.diagnostics.clear()
    expected = {f"region_segmentation/{name}: segmentation" for name in ("right", "rear")}
    until(lambda: {report.status[0].name for report in listener.diagnostics} == expected, "the figures of both")
    assert int(figures(listener, "right")["clouds processed"]) == len(sides["right"].labeled), "the counts go on"


@pytest.mark.parametrize(("names", "said"), [("[a, b, a]", "'a' is there twice"), ("['a b']", "'a b' is no name")])
def test_names_that_cannot_be_are_refused(ros_domain: int, tmp_path: Any, names: str, said: str) -> None:
    process = NodeProcess(ros_domain, tmp_path / "log.txt", "-p", f"cameras:={names}")
    try:
        assert process.process.wait(STARTUP) == WRONG_USAGE
    finally:
        process.process.kill()
    assert said in process.log and "Traceback" not in process.log
