# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The message classes of rosbags, for reading and writing recordings without ROS."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from topo_region_seg.cloud.messages.types import MessageTypes

_PACKAGES = {
    "sensor_msgs": ("PointCloud2", "PointField", "Image", "CompressedImage"),
    "std_msgs": ("UInt32", "Header", "ColorRGBA"),
    "builtin_interfaces": ("Time", "Duration"),
    "visualization_msgs": ("Marker", "MarkerArray", "MeshFile"),
    "geometry_msgs": ("Point", "Vector3", "Quaternion", "Pose", "PoseWithCovariance"),
    "vision_msgs": (
        "Detection3DArray",
        "Detection3D",
        "ObjectHypothesisWithPose",
        "ObjectHypothesis",
        "BoundingBox3D",
    ),
}
VISION_MSGS = {
    "ObjectHypothesis": "string class_id\nfloat64 score\n",
    "ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "Detection3D": ("std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id\n"),
    "Detection3DArray": "std_msgs/Header header\nDetection3D[] detections\n",
}
"""The messages of vision_msgs that are written, which rosbags does not know."""


@lru_cache(maxsize=1)
def typestore() -> Typestore:
    """Return the message types of ROS 2 Jazzy, and some of vision_msgs."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, definition in VISION_MSGS.items():
        store.register(get_types_from_msg(definition, f"vision_msgs/msg/{name}"))
    return store


@lru_cache(maxsize=1)
def bag_types() -> MessageTypes:
    """Return rosbags' message classes."""
    known = typestore().types
    classes = {name: known[f"{package}/msg/{name}"] for package, names in _PACKAGES.items() for name in names}
    return MessageTypes(**{f.name: classes[f.name] for f in fields(MessageTypes)})
