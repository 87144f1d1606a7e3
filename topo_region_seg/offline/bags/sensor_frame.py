# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the sensor was, from the transforms of a recording, for clouds in a robot's own frame."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from topo_region_seg.data import Cloud, FloatArray
from topo_region_seg.offline.bags.clouds import cdr
from topo_region_seg.offline.bags.records import BagReader
from topo_region_seg.offline.bags.types import typestore

TF = "tf2_msgs/msg/TFMessage"
TOPICS = ("/tf_static", "/tf")
SENSOR = "optical"
"""What the name of a camera's frame holds (REP 103)."""
TOGETHER = 0.2
"""Farthest that the sensors of one camera are apart, metres: any of them will do."""

Transform = tuple[Rotation, FloatArray]


@dataclass
class _Edge:
    """The transforms from a frame to its parent, by stamp, seconds."""

    parent: str
    stamps: list[float] = field(default_factory=list)
    transforms: list[Transform] = field(default_factory=list)

    def at(self, stamp: float) -> Transform:
        """Return the transform at a time: the last one until then, or the first."""
        return self.transforms[max(bisect_right(self.stamps, stamp) - 1, 0)]


class SensorFrame:
    """Tells clouds of a recording where their sensor was.

    A cloud in a frame of a camera (its name holds "optical") was seen from the origin. For one in another frame the
    transforms of the recording are followed to a camera's frame, if there is just one, or several within 0.2 m.

    Attributes
    ----------
    note : str
        What was found, in one line; empty if nothing was.
    """

    def __init__(self, reader: BagReader) -> None:
        self.note = ""
        self._reader = reader
        self._edges: dict[str, _Edge] | None = None

    def place(self, cloud: Cloud, msg: Any) -> Cloud:
        """Return the cloud of a message with its `sensor_pose`, where the recording tells it."""
        frame = str(msg.header.frame_id).lstrip("/")
        if SENSOR in frame or not any(self._reader.count(topic) for topic in TOPICS):
            return cloud
        stamp = msg.header.stamp.sec + 1e-9 * msg.header.stamp.nanosec
        if self._edges is None:
            self._edges = self._read()
        poses = {}
        for sensor in sorted(self._edges, key=lambda name: ("depth" not in name, name)):
            if SENSOR in sensor and (found := self._between(frame, sensor, stamp)) is not None:
                poses[sensor] = found
        if not poses:
            return cloud
        sensor, (rotation, position) = next(iter(poses.items()))
        if any(np.linalg.norm(other - position) > TOGETHER for _, other in poses.values()):
            self.note = f"several cameras are in the transforms ({', '.join(poses)}); set sensor_pose to that of one"
            return cloud
        self.note = f"clouds are in the frame {frame}: seen from {sensor}, by the transforms of the recording"
        x, y, z, w = rotation.as_quat()
        return replace(cloud, sensor_pose=(*position.tolist(), float(w), float(x), float(y), float(z)))

    def _read(self) -> dict[str, _Edge]:
        edges: dict[str, _Edge] = {}
        for record in self._reader.messages([topic for topic in TOPICS if self._reader.count(topic)]):
            try:
                message: Any = typestore().deserialize_cdr(cdr(replace(record, type=TF)), TF)
            except Exception:  # any byte may be wrong; a damaged transform leaves the others
                continue
            for item in message.transforms:
                edge = edges.setdefault(item.child_frame_id.lstrip("/"), _Edge(item.header.frame_id.lstrip("/")))
                q, t = item.transform.rotation, item.transform.translation
                if not np.linalg.norm([q.x, q.y, q.z, q.w]) > 0.0:
                    continue
                stamp = item.header.stamp.sec + 1e-9 * item.header.stamp.nanosec
                place = bisect_right(edge.stamps, stamp)
                edge.stamps.insert(place, stamp)
                edge.transforms.insert(place, (Rotation.from_quat([q.x, q.y, q.z, q.w]), np.array([t.x, t.y, t.z])))
        return {child: edge for child, edge in edges.items() if edge.transforms}

    def _between(self, frame: str, sensor: str, stamp: float) -> Transform | None:
        """Return the pose of one frame in another at a time, seconds; None where no transforms lead there."""
        assert self._edges is not None
        neighbors: dict[str, list[tuple[str, Transform]]] = {}
        for child, edge in self._edges.items():
            rotation, position = edge.at(stamp)
            neighbors.setdefault(edge.parent, []).append((child, (rotation, position)))
            neighbors.setdefault(child, []).append((edge.parent, (rotation.inv(), -rotation.inv().apply(position))))
        found: dict[str, Transform] = {frame: (Rotation.identity(), np.zeros(3))}
        waiting = deque([frame])
        while waiting and sensor not in found:
            here = waiting.popleft()
            rotation, position = found[here]
            for there, (turn, step) in neighbors.get(here, []):
                if there not in found:
                    found[there] = (rotation * turn, position + rotation.apply(step))
                    waiting.append(there)
        return found.get(sensor)
