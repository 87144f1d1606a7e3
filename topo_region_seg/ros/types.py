# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The message classes of rclpy."""

from __future__ import annotations

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from sensor_msgs.msg import CompressedImage, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header, UInt32
from visualization_msgs.msg import Marker, MarkerArray, MeshFile

from topo_region_seg.cloud.messages import MessageTypes


def ros_types() -> MessageTypes:
    """Return the classes that :mod:`topo_region_seg.cloud.messages` fills."""
    return MessageTypes(
        PointCloud2=PointCloud2,
        PointField=PointField,
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
        ColorRGBA=ColorRGBA,
        CompressedImage=CompressedImage,
        MeshFile=MeshFile,
    )
