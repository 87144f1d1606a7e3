# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A node over DDS that works on demand: for who subscribes, and for who calls ~/segment_once."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from lifecycle_msgs.msg import Transition
from ros_harness import STARTUP, Client, NodeProcess, cloud_message, running_node, until
from sensor_msgs.msg import Image, PointCloud2
from std_srvs.srv import Trigger


@pytest.fixture(scope="module")
def node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("node") / "log.txt"
    with running_node(ros_domain, log, "--log-level", "region_segmentation:=debug") as process:
        yield process


@pytest.fixture(scope="module")
def client(ros_domain: int, node: NodeProcess) -> Iterator[Client]:
    """A camera that nobody needs: it subscribes to no labels."""
    client = Client(ros_domain, labels=False)
    client.wait_for_node()
    yield client
    client.close()


@pytest.fixture(autouse=True)
def defaults(client: Client) -> Iterator[None]:
    yield
    assert client.set_atomically({"on_request": False, "request_timeout": 5.0, "rate_limit": 0.0}).successful


def sheet() -> PointCloud2:
    x, y = (0.004 * grid.ravel() for grid in np.meshgrid(np.arange(40), np.arange(40)))
    xyz = np.column_stack([x, y, np.full(x.size, 0.8)])
    return cloud_message(xyz, np.full((x.size, 3), 90, np.uint8), height=40)


class Camera:
    """Publishes clouds from a thread until it is stopped; a context manager."""

    def __init__(self, client: Client, make: Callable[[], PointCloud2] = sheet) -> None:
        self._client, self._make = client, make
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        while not self._stop.wait(0.03):
            self._client.publish(self._make())

    def __enter__(self) -> Camera:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


def status(client: Client) -> Any:
    return client.diagnostics[-1].status[0]


def asleep(client: Client) -> bool:
    return not client.points.get_subscription_count()


def once(client: Client) -> Trigger.Response:
    return client.call(Trigger, "segment_once", Trigger.Request())


def test_without_subscribers_no_cloud_is_processed(client: Client, node: NodeProcess) -> None:
    with Camera(client):
        until(lambda: asleep(client), "the node to stop listening")
        until(lambda: status(client).message == "nobody subscribes", "the diagnostics to say why")
        assert status(client).level == b"\x00"
        figures = client.figures()
        assert int(figures["passed over: nobody subscribes"]) > 0
        counts = {name: int(figures[f"clouds {name}"]) for name in ("processed", "dropped", "rejected", "passed over")}
        assert sum(counts.values()) == int(figures["clouds received"])
        assert counts["dropped"] == counts["rejected"] == 0
        node.wait_for_log("nobody subscribes: not listening to /points meanwhile")
        seen = len(client.diagnostics)
        until(lambda: len(client.diagnostics) > seen + 6, "reports of more than input_timeout")
        assert status(client).level == b"\x00", "silence is as it should be"
        assert client.figures()["clouds processed"] == figures["clouds processed"]


def test_any_topic_wakes_it_and_only_what_is_subscribed_to_is_made(client: Client, node: NodeProcess) -> None:
    with Camera(client):
        until(lambda: asleep(client), "the node to stop listening")
    images: list[Any] = []
    subscription = client.node.create_subscription(Image, "label_image", images.append, 1)
    try:
        with Camera(client):
            until(lambda: images, "a label image")
        assert (images[0].encoding, images[0].height, images[0].width) == ("mono16", 40, 40)
        published = [line.partition(", published ")[2] for line in node.log.splitlines() if ", published " in line]
        assert published[-1] == "label_image" and set(published) <= {"label_image", "nothing"}
    finally:
        client.node.destroy_subscription(subscription)
    with Camera(client):
        until(lambda: asleep(client), "the node to stop listening again")


def test_segment_once_processes_one_cloud_and_answers_then(client: Client) -> None:
    assert client.set_parameters({"on_request": True})[0].successful
    labeled = client.collect(PointCloud2, "labeled_points")
    with Camera(client):
        until(lambda: asleep(client), "the node to stop listening, whoever subscribes")
        until(lambda: status(client).message == "waiting for ~/segment_once (on_request)", "the diagnostics to say why")
        assert status(client).level == b"\x00"
        answer = once(client)
        assert answer.success, answer.message
        assert "40x40 points" in answer.message
        until(lambda: labeled, "labels")
        assert once(client).success
    until(lambda: len(labeled) == 2, "two answers")
    stamps = [f"{msg.header.stamp.sec}." for msg in labeled]
    assert stamps[0] in answer.message
    time.sleep(0.3)
    assert len(labeled) == 2, "and no more"


def test_segment_once_says_why_not_within_its_time_and_blocks_nobody(client: Client) -> None:
    assert client.set_atomically({"on_request": True, "request_timeout": 1.0}).successful
    answers: list[Trigger.Response] = []
    asking = threading.Thread(target=lambda: answers.append(once(client)))
    asking.start()
    assert client.get_parameter("request_timeout") == 1.0, "other services answer meanwhile"
    waiting = not answers
    asking.join(STARTUP)
    assert waiting
    assert not answers[0].success
    assert answers[0].message == "no cloud came on /points and was processed within 1 s"


def test_segment_once_tells_what_is_wrong_with_the_cloud(client: Client) -> None:
    def torn() -> PointCloud2:
        msg = sheet()
        msg.data = msg.data[:-5]
        return msg

    assert client.set_parameters({"on_request": True})[0].successful
    with Camera(client, torn):
        answer = once(client)
    assert not answer.success
    assert answer.message.startswith("cloud rejected: ") and answer.message.endswith("(data_too_short)")


def test_an_inactive_node_refuses_and_one_that_is_deactivated_gives_up(client: Client) -> None:
    assert client.set_atomically({"on_request": True, "request_timeout": 60.0}).successful
    with Camera(client):
        until(lambda: asleep(client), "the node to stop listening")
    answers: list[Trigger.Response] = []
    asking = threading.Thread(target=lambda: answers.append(once(client)))
    asking.start()
    until(client.points.get_subscription_count, "the node to listen")
    assert client.change_state(Transition.TRANSITION_DEACTIVATE)
    asking.join(STARTUP)
    assert (answers[0].success, answers[0].message) == (False, "the node was deactivated")
    refused = once(client)
    assert (refused.success, refused.message) == (False, "the node is inactive; activate it first")
    seen = len(client.diagnostics)
    until(lambda: len(client.diagnostics) > seen + 1, "more reports")
    assert (status(client).level, status(client).message) == (b"\x00", "inactive"), "as was asked for"
    assert client.change_state(Transition.TRANSITION_ACTIVATE)


def test_the_rate_is_limited(client: Client) -> None:
    labeled = client.collect(PointCloud2, "labeled_points")
    with Camera(client):
        until(lambda: len(labeled) > 3, "labels")
        assert client.set_parameters({"rate_limit": 0.01})[0].successful
        until(lambda: int(client.figures().get("passed over: rate limit", "0")) > 10, "clouds beyond the limit")
        heard = len(labeled)
        time.sleep(0.3)
        assert len(labeled) == heard


def test_a_node_that_nobody_activates_is_an_error(ros_domain: int, tmp_path: Any) -> None:
    domain = ros_domain + 50
    given = "-p", "autostart:=false", "-p", "inactive_timeout:=1.0", "-p", "hardware_id:=D435 0815"
    with running_node(domain, tmp_path / "log.txt", *given):
        client = Client(domain, labels=False)
        try:
            until(lambda: client.diagnostics and status(client).level == b"\x02", "an error")
            assert "unconfigured for " in status(client).message and "inactive_timeout" in status(client).message
            assert status(client).hardware_id == "D435 0815"
            assert client.set_parameters({"inactive_timeout": 0.0})[0].successful
            until(lambda: status(client).level == b"\x00", "no error")
        finally:
            client.close()


def test_the_first_answer_s_frame_is_the_hardware_id(client: Client) -> None:
    assert status(client).hardware_id == "camera_depth_optical_frame"
