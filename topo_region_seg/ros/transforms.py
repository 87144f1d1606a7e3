# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where sensor and robot are, and the frame of the output, from TF at the time of each frame.

tf2_ros is loaded only where a parameter asks for it. Its transforms come in on the node's executor; the worker waits
for them, for a bounded time.
"""

from __future__ import annotations

import time
from copy import copy
from dataclasses import replace
from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.time import Time

from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.cloud.placing import Transform, moved
from topo_region_seg.data import Cloud
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.ros.node_params import NodeParams

PAUSE = 0.005
"""Seconds between two looks for a transform that is waited for."""
NAMES = ("sensor_frame", "base_frame", "output_frame")


class Transforms:
    """Tells clouds where their sensor and the robot's base are, and moves them to the frame of the output.

    Parameters
    ----------
    node : LifecycleNode
        The node that listens to /tf and /tf_static.
    settings : NodeParams
        Uses `sensor_frame`, `base_frame`, `output_frame` and `transform_timeout`.

    Raises
    ------
    ParameterError
        tf2_ros is not installed.
    """

    def __init__(self, node: LifecycleNode, settings: NodeParams) -> None:
        try:
            from tf2_ros import Buffer, TransformListener
        except ImportError as error:
            asked = next(name for name in NAMES if getattr(settings, name))
            raise ParameterError(
                f"{asked} = '{getattr(settings, asked)}' needs tf2_ros ({error}): install ros-jazzy-tf2-ros-py; or "
                "leave it out, and set sensor_pose, up and crop_box_pose where nothing moves"
            ) from None
        self._settings = settings
        self._buffer = Buffer()
        self._listener = TransformListener(self._buffer, node, spin_thread=False)

    @staticmethod
    def wanted(settings: NodeParams) -> bool:
        """Return whether a parameter asks for transforms."""
        return any(getattr(settings, name) for name in NAMES)

    def close(self) -> None:
        """Listen no longer."""
        self._listener.unregister()

    def place(self, cloud: Cloud, header: Any) -> tuple[Cloud, str]:
        """Return a cloud with what is known of its frame, and the frame that it is in then.

        Raises
        ------
        CloudFormatError
            A transform has not come in time (`no_transform`).
        """
        frame, settings = str(header.frame_id).lstrip("/"), self._settings
        end = time.monotonic() + settings.transform_timeout
        try:
            stamp = Time.from_msg(header.stamp)
        except ValueError as error:  # rclpy's for one before 1970
            raise CloudFormatError("no_transform", f"no transforms at the time of the frame: {error}") from None
        if settings.sensor_frame:
            pose = self._look_up(frame, settings.sensor_frame, stamp, end, "sensor_frame")
            cloud = replace(cloud, sensor_pose=pose.pose)
        if settings.base_frame:
            pose = self._look_up(frame, settings.base_frame, stamp, end, "base_frame")
            cloud = replace(cloud, base_pose=pose.pose)
        if settings.output_frame and settings.output_frame.lstrip("/") != frame:
            cloud = moved(cloud, self._look_up(settings.output_frame, frame, stamp, end, "output_frame"))
            return cloud, settings.output_frame.lstrip("/")
        return cloud, str(header.frame_id)

    def _look_up(self, target: str, source: str, stamp: Time, end: float, name: str) -> Transform:
        """Return what takes positions of the frame `source` to `target`; wait for it until `end`, monotonic seconds."""
        target, source = target.lstrip("/"), source.lstrip("/")
        while True:
            try:
                found = self._buffer.lookup_transform(target, source, stamp).transform
                q, t = found.rotation, found.translation
                return Transform.of_pose((t.x, t.y, t.z, q.w, q.x, q.y, q.z))
            except Exception as error:  # tf2's are of many kinds, and may name what is missing better than we can
                if time.monotonic() >= end:
                    why = " ".join(str(error).split())
                    raise CloudFormatError(
                        "no_transform",
                        f"no transform from '{source}' to '{target}' ({name}) within "
                        f"{self._settings.transform_timeout:g} s: {why}",
                    ) from None
            time.sleep(PAUSE)


def in_frame(msg: Any, frame_id: str) -> Any:
    """Return a message with the header of another frame; the data are the same, and the message is not modified."""
    if msg.header.frame_id == frame_id:
        return msg
    made = copy(msg)
    made.header = copy(msg.header)
    made.header.frame_id = frame_id
    return made
