# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames of the soak test, serialized once: clouds as a ZED lays them out, or depth images; and malformed ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.serialization import serialize_message

from benchmarks.points import pack_rgb
from benchmarks.tabletops import FRAME, camera, seen
from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.simulation.images import COLOR_TOPIC, DEPTH_TOPIC, INFO_TOPIC, image_messages
from topo_region_seg.offline.simulation.recording import make_header
from topo_region_seg.ros.types import ros_types

Frame = Mapping[str, bytes]
"""CDR of what a camera sends at one time, by the node's names of the topics, the one that counts last."""

SEEDS = (1, 2, 3)
SIZES = ((640, 480), (480, 360))
"""Pixels: the camera's, and its other ones after some restarts, where it sends depth images."""
TOPICS = {INFO_TOPIC: "depth/camera_info", COLOR_TOPIC: "color/image", DEPTH_TOPIC: "depth/image"}
"""Of a recording, and what the node calls them."""


def good_frames(kind: str, size: tuple[int, int] = SIZES[0]) -> list[Frame]:
    """Return simulated frames of tabletops; `kind` is "points" or "depth"."""
    if kind == "points":
        return [{"points": serialize_message(_cloud(seen(seed, *size)))} for seed in SEEDS]
    return [_images(seen(seed, *size), size) for seed in SEEDS]


def bad_frames(kind: str) -> list[Frame]:
    """Return frames that contradict themselves, each in another way."""
    if kind == "depth":
        return [_images(seen(SEEDS[0], *SIZES[0]), SIZES[0], damage) for damage in (_cut, _no_step, _huge, _encoding)]
    frames: list[Frame] = []
    for damage in (_cut, _no_point_step, _huge, _no_fields, _bad_stamp):
        msg = _cloud(seen(SEEDS[0], *SIZES[0]))
        damage(msg)
        frames.append({"points": serialize_message(msg)})
    return frames


def _cloud(cloud: Cloud) -> Any:
    types = ros_types()
    assert cloud.rgb is not None
    xyz = cloud.xyz
    columns = {"x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2], "rgb": pack_rgb(cloud.rgb)}
    header = types.Header(frame_id=FRAME)
    return encode(types, header, columns, height=cloud.height, width=cloud.width, is_dense=False)


def _images(cloud: Cloud, size: tuple[int, int], damage: Callable[[Any], None] | None = None) -> Frame:
    frame: dict[str, bytes] = {}
    for topic, msg in image_messages(make_header(0, FRAME), cloud, camera(*size)):
        if damage is not None and topic == DEPTH_TOPIC:
            damage(msg)
        frame[TOPICS[topic]] = bytes(typestore().serialize_cdr(msg, msg.__msgtype__))
    return frame


def _cut(msg: Any) -> None:
    msg.data = msg.data[: len(msg.data) // 3]


def _no_point_step(msg: Any) -> None:
    msg.point_step = 0


def _no_step(msg: Any) -> None:
    msg.step = 0


def _huge(msg: Any) -> None:
    msg.width = msg.height = 2**32 - 1


def _no_fields(msg: Any) -> None:
    msg.fields = []


def _encoding(msg: Any) -> None:
    msg.encoding = "8UC3"


def _bad_stamp(msg: Any) -> None:
    msg.header.stamp.nanosec = 2**32 - 1
