# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The clouds of the soak test, serialized once: VGA as a ZED lays it out (4.9 MB), and malformed ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.serialization import serialize_message

from benchmarks.points import pack_rgb
from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.ros.types import ros_types

SEEDS = (1, 2, 3)


def good_frames() -> list[bytes]:
    """Return simulated 640 x 480 clouds of tabletops, in CDR."""
    return [serialize_message(_message(seed)) for seed in SEEDS]


def bad_frames() -> list[bytes]:
    """Return clouds that contradict themselves, each in another way, in CDR."""
    damages: list[Callable[[Any], None]] = [_cut, _no_step, _huge, _no_fields, _bad_stamp]
    frames = []
    for damage in damages:
        msg = _message(SEEDS[0])
        damage(msg)
        frames.append(serialize_message(msg))
    return frames


def _message(seed: int) -> Any:
    types = ros_types()
    cloud = simulate(tabletop(seed), Camera.kinect(640, 480), seed=seed).cloud
    assert cloud.rgb is not None
    xyz = cloud.xyz
    columns = {"x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2], "rgb": pack_rgb(cloud.rgb)}
    header = types.Header(frame_id="camera")
    return encode(types, header, columns, height=480, width=640, is_dense=False)


def _cut(msg: Any) -> None:
    msg.data = msg.data[: len(msg.data) // 3]


def _no_step(msg: Any) -> None:
    msg.point_step = 0


def _huge(msg: Any) -> None:
    msg.width = msg.height = 2**32 - 1


def _no_fields(msg: Any) -> None:
    msg.fields = []


def _bad_stamp(msg: Any) -> None:
    msg.header.stamp.nanosec = 2**32 - 1
