# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The message classes of rosbags, for reading and writing recordings without ROS."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from topo_region_seg.cloud.messages import MessageTypes

_PACKAGES = {
    "sensor_msgs": ("PointCloud2", "PointField", "CompressedImage"),
    "std_msgs": ("UInt32", "Header", "ColorRGBA"),
    "builtin_interfaces": ("Time", "Duration"),
    "visualization_msgs": ("Marker", "MarkerArray", "MeshFile"),
    "geometry_msgs": ("Point", "Vector3", "Quaternion", "Pose"),
}


@lru_cache(maxsize=1)
def typestore() -> Typestore:
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache(maxsize=1)
def bag_types() -> MessageTypes:
    """Return rosbags' message classes."""
    known = typestore().types
    classes = {name: known[f"{package}/msg/{name}"] for package, names in _PACKAGES.items() for name in names}
    return MessageTypes(**{f.name: classes[f.name] for f in fields(MessageTypes)})
