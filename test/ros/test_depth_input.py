# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every depth image is processed, dropped or rejected, whatever comes with it; without a network."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_msgs.msg import CameraInfo, Image

from topo_region_seg.ros.advice import advice
from topo_region_seg.ros.depth_input import COLOR, DEPTH, INFO, DepthInput
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.missing_images import no_color
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.statistics import Statistics

PERIOD = 33_000_000


class Rig:
    """An input whose node, color and worker are the test's: a frame is processed as soon as it is handed over."""

    def __init__(self, color: bool | None = True) -> None:
        self.lines: list[str] = []
        self.frames: list[Any] = []
        self.callbacks: dict[str, Any] = {}
        self.color = color
        self.statistics = Statistics()
        node = MagicMock()
        node.resolve_topic_name.side_effect = lambda name: f"/{name}"
        node.get_publishers_info_by_topic.return_value = []
        node.get_topic_names_and_types.return_value = []
        node.count_publishers.return_value = 1
        node._parameter_overrides = {}
        node.create_subscription.side_effect = self._subscribed
        node.destroy_subscription.side_effect = lambda name: self.callbacks.pop(name.topic)
        log = ReasonLog(SimpleNamespace(warning=self.lines.append), lambda: 0.0)  # type: ignore[arg-type]
        self.source = DepthInput(
            Feed(node, log, statistics=self.statistics), self._process, NodeParams(), lambda: self.color
        )
        self.source._worker.submit = self._submit  # type: ignore[method-assign]

    def _subscribed(self, kind: type, topic: str, callback: Any, *_: Any, **__: Any) -> SimpleNamespace:
        self.callbacks[topic] = callback
        return SimpleNamespace(topic=topic)

    def _process(self, frame: Any) -> None:
        raise AssertionError("the worker has nothing to do here")

    def _submit(self, frame: Any) -> bool:
        self.frames.append(frame)
        return False

    def send(self, topic: str, msg: Any, stamp: int) -> None:
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(stamp, 10**9)
        self.callbacks[topic](msg, {})

    def depth(self, stamp: int, width: int = 4) -> None:
        self.send(DEPTH, Image(height=2, width=width), stamp)

    def info(self, width: int = 4) -> None:
        self.send(INFO, CameraInfo(height=2, width=width), 0)


@given(
    events=st.lists(st.tuples(st.sampled_from("dci"), st.integers(0, 12), st.sampled_from([4, 6])), max_size=40),
    color=st.sampled_from([True, False, None]),
    change=st.integers(0, 40),
)
@settings(max_examples=150, deadline=None)
def test_what_is_received_is_processed_dropped_or_rejected(
    events: list[tuple[str, int, int]], color: bool | None, change: int
) -> None:
    rig = Rig(color)
    for place, (kind, number, width) in enumerate(events):
        if place == change:
            rig.color = not color
            rig.source.follow_publishers()
        if kind == "d":
            rig.depth(number * PERIOD, width)
        elif kind == "i":
            rig.info(width)
        elif COLOR in rig.callbacks:
            rig.send(COLOR, Image(height=2, width=width), number * PERIOD)
    rig.source.close(10)
    now = rig.statistics.snapshot()
    assert now.received == sum(kind == "d" for kind, *_ in events)
    assert now.received == len(rig.frames) + now.dropped + sum(now.rejected.values())
    for frame in rig.frames:
        assert frame.info.width == frame.msg.width
    assert not rig.callbacks, "all subscriptions are gone"


def test_a_depth_image_waits_for_its_camera_info_and_the_newest_wins() -> None:
    rig = Rig(color=False)
    for number in range(3):
        rig.depth(number * PERIOD)
    assert not rig.frames
    assert rig.statistics.snapshot().rejected == {"no_camera_info": 2}
    rig.info()
    assert [frame.msg.header.stamp.nanosec for frame in rig.frames] == [2 * PERIOD]
    rig.source.close(10)


def test_color_of_use_is_taken_but_not_waited_for() -> None:
    rig = Rig(color=None)
    rig.info()
    for number in range(1, 6):
        rig.depth(number * PERIOD)
        if number % 2:
            rig.send(COLOR, Image(height=2, width=4), number * PERIOD)
    rig.source.close(10)
    colored = [(frame.msg.header.stamp.nanosec // PERIOD, frame.color is not None) for frame in rig.frames]
    assert colored == [(1, True), (2, False), (3, True), (4, False), (5, True)]
    assert not rig.statistics.snapshot().rejected


def test_missing_color_names_a_way_to_do_without() -> None:
    rig = Rig()
    rig.info()
    for number in range(12):
        rig.depth(number * PERIOD)
    assert rig.statistics.snapshot().rejected == {"no_color": 4}
    assert "no color images on /color/image" in rig.lines[0] and "set features to 'normals'" in rig.lines[0]
    rig.source.close(10)
    assert rig.statistics.snapshot().dropped == 8


@pytest.mark.parametrize(
    ("color", "topics", "said"),
    [
        ("/color/image", {"/a/rgb": "Image"}, "remap with --ros-args -r color/image:=/a/rgb"),
        (
            "/color/image",
            {"/b/depth": "Image", "/a/gray": "Image", "/z/color": "Image", "/depth/image": "Image"},
            "-r color/image:=/z/color or -r color/image:=/a/gray or -r color/image:=/b/depth",
        ),
        ("/color/image", {"/color/image/compressed": "CompressedImage"}, "; or set color_transport to compressed for"),
        ("/c/compressed", {"/a/rgb/compressed": "CompressedImage"}, "-r color/image:=/a/rgb"),
        ("/c/compressed", {"/a/rgb": "Image"}, "nobody publishes sensor_msgs/CompressedImage"),
    ],
)
def test_missing_color_names_the_images_that_there_are(color: str, topics: dict[str, str], said: str) -> None:
    node: Any = SimpleNamespace(
        count_publishers=lambda topic: topic in topics,
        get_topic_names_and_types=lambda: [(name, [f"sensor_msgs/msg/{kind}"]) for name, kind in topics.items()],
    )
    text = no_color(node, "/depth/image", color)
    assert said in text and text.endswith("; or set features to 'normals', which need no color") and "\n" not in text


def test_silence_of_packed_images_names_what_is_before_the_packing() -> None:
    topics = {"/cam/depth/compressedDepth": "CompressedImage", "/cam/rgb/compressed": "CompressedImage"}
    node: Any = SimpleNamespace(
        get_publishers_info_by_topic=lambda topic: [],
        count_publishers=lambda topic: int(topic in topics),
        get_topic_names_and_types=lambda: [(name, [f"sensor_msgs/msg/{kind}"]) for name, kind in topics.items()],
        get_node_names_and_namespaces=lambda: [],
    )
    kind = "sensor_msgs/msg/CompressedImage"
    source: Any = SimpleNamespace(topic="/depth/image/compressedDepth", kind=kind, name="depth/image")
    assert advice(node, source, heard=False).endswith("remap with --ros-args -r depth/image:=/cam/depth")
