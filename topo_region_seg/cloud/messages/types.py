# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The message classes that are filled, whichever ROS library they come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MessageTypes:
    """The message classes of one ROS library; all of them take their fields as keyword arguments.

    The last ones, of vision_msgs, are None where that package is missing.
    """

    PointCloud2: Any
    PointField: Any
    Image: Any
    UInt32: Any
    Header: Any
    Time: Any
    Duration: Any
    Marker: Any
    MarkerArray: Any
    Point: Any
    Vector3: Any
    Quaternion: Any
    Pose: Any
    PoseWithCovariance: Any
    ColorRGBA: Any
    CompressedImage: Any
    MeshFile: Any
    Detection3DArray: Any = None
    Detection3D: Any = None
    ObjectHypothesisWithPose: Any = None
    ObjectHypothesis: Any = None
    BoundingBox3D: Any = None
