# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's output topics."""

from __future__ import annotations

from rclpy.lifecycle import LifecycleNode, LifecyclePublisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import UInt32
from visualization_msgs.msg import MarkerArray

from topo_region_seg.cloud import messages
from topo_region_seg.data import Cloud
from topo_region_seg.ros.qos_overrides import overriding
from topo_region_seg.ros.types import ros_types
from topo_region_seg.segmentation import Segmentation

CLOUDS = ("labeled_points", "regions", "barcode", "region_colors")
"""Outputs that are clouds themselves, and no input for another such node."""


class Outputs:
    """Lifecycle publishers of all that is said about a frame: reliable, depth 1, QoS overridable by parameters.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
    """

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        self._types = ros_types()
        self._publishers: list[LifecyclePublisher] = []
        try:
            self._labeled_points = self._create(PointCloud2, "labeled_points")
            self._region_count = self._create(UInt32, "region_count")
            self._regions = self._create(PointCloud2, "regions")
            self._barcode = self._create(PointCloud2, "barcode")
            self._region_markers = self._create(MarkerArray, "region_markers")
            self._region_colors = self._create(PointCloud2, "region_colors")
        except Exception:
            self.destroy()
            raise

    def publish(self, msg: PointCloud2, cloud: Cloud, seg: Segmentation) -> None:
        """Publish what is known of the frame `msg`; all but labels and count only while somebody subscribes."""
        types, header = self._types, msg.header
        self._labeled_points.publish(messages.labeled_points(types, msg, cloud, seg))
        self._region_count.publish(messages.region_count(types, seg))
        if self._regions.get_subscription_count():
            self._regions.publish(messages.regions(types, header, seg))
        if self._barcode.get_subscription_count():
            self._barcode.publish(messages.barcode(types, header, seg))
        if self._region_markers.get_subscription_count():
            self._region_markers.publish(messages.region_markers(types, header, seg))
        if self._region_colors.get_subscription_count():
            self._region_colors.publish(messages.region_colors(types, msg, cloud, seg))

    def destroy(self) -> None:
        """Remove the topics."""
        for publisher in self._publishers:
            self._node.destroy_lifecycle_publisher(publisher)
        self._publishers.clear()

    def _create(self, kind: type, topic: str) -> LifecyclePublisher:
        publisher = self._node.create_lifecycle_publisher(
            kind, topic, QoSProfile(depth=1), qos_overriding_options=overriding(self._node, topic, "publisher")
        )
        self._publishers.append(publisher)
        return publisher
