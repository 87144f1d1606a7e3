# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""As much of tf2_ros as the node uses, where it is not installed: transforms come on /tf_standin, one a message.

A transform whose child is "clear" forgets all. Chains are followed; times are those of the last message, as of static
transforms.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation

TOPIC = "/tf_standin"


class LookupException(Exception):
    """tf2's."""


class Buffer:
    def __init__(self) -> None:
        self.edges: dict[str, tuple[str, Rotation, Any]] = {}

    def _to_root(self, frame: str) -> tuple[str, Rotation, Any]:
        rotation, position = Rotation.identity(), np.zeros(3)
        while frame in self.edges:
            frame, turn, step = self.edges[frame]
            rotation, position = turn * rotation, turn.apply(position) + step
        return frame, rotation, position

    def lookup_transform(self, target: str, source: str, stamp: Any) -> Any:
        (root, turn, step), (other, rotation, position) = self._to_root(target), self._to_root(source)
        if root != other:
            raise LookupException(f'"{source}" and "{target}" are not connected\nin the tree')
        rotation, position = turn.inv() * rotation, turn.inv().apply(position - step)
        x, y, z, w = rotation.as_quat()
        return SimpleNamespace(
            transform=SimpleNamespace(
                rotation=SimpleNamespace(x=x, y=y, z=z, w=w),
                translation=SimpleNamespace(x=position[0], y=position[1], z=position[2]),
            )
        )


class TransformListener:
    def __init__(self, buffer: Buffer, node: Any, *, spin_thread: bool) -> None:
        assert not spin_thread
        self._buffer, self._node = buffer, node
        quality = QoSProfile(depth=20, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._subscription = node.create_subscription(TransformStamped, TOPIC, self._take, quality)

    def _take(self, msg: TransformStamped) -> None:
        if msg.child_frame_id == "clear":
            self._buffer.edges.clear()
            return
        q, t = msg.transform.rotation, msg.transform.translation
        turn = Rotation.from_quat([q.x, q.y, q.z, q.w])
        self._buffer.edges[msg.child_frame_id] = (msg.header.frame_id, turn, np.array([t.x, t.y, t.z]))

    def unregister(self) -> None:
        self._node.destroy_subscription(self._subscription)
