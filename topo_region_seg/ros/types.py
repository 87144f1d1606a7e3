# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The message classes of rclpy."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Vector3
from sensor_msgs.msg import CompressedImage, Image, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header, UInt32
from visualization_msgs.msg import Marker, MarkerArray, MeshFile

from topo_region_seg.cloud.messages.types import MessageTypes


def ros_types() -> MessageTypes:
    """Return the classes that :mod:`topo_region_seg.cloud.messages` fills, those of vision_msgs where it is there."""
    return MessageTypes(
        PointCloud2=PointCloud2,
        PointField=PointField,
        Image=Image,
        UInt32=UInt32,
        Header=Header,
        Time=Time,
        Duration=Duration,
        Marker=Marker,
        MarkerArray=MarkerArray,
        Point=Point,
        Vector3=Vector3,
        Quaternion=Quaternion,
        Pose=Pose,
        PoseWithCovariance=PoseWithCovariance,
        ColorRGBA=ColorRGBA,
        CompressedImage=CompressedImage,
        MeshFile=MeshFile,
        **_vision_types(),
    )


def _vision_types() -> dict[str, Any]:
    """Return the classes of vision_msgs, which comes from apt alone; none where it is missing."""
    try:
        from vision_msgs.msg import (
            BoundingBox3D,
            Detection3D,
            Detection3DArray,
            ObjectHypothesis,
            ObjectHypothesisWithPose,
        )
    except ImportError:
        return {}
    classes = (BoundingBox3D, Detection3D, Detection3DArray, ObjectHypothesis, ObjectHypothesisWithPose)
    return {kind.__name__: kind for kind in classes}
