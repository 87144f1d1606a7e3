# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Once a second: diagnostics on a topic and, when no clouds come, a word of advice in the log."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.ros.diagnostics import diagnostics
from topo_region_seg.ros.input import Input
from topo_region_seg.ros.statistics import Statistics

CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"


class Reporter:
    """Publish the node's diagnostics, in every lifecycle state; reliable, depth 10, QoS overridable by parameters.

    Raises
    ------
    ParameterError
        If a QoS override for the topic is invalid.
    """

    def __init__(self, node: LifecycleNode, statistics: Statistics) -> None:
        self._node = node
        self._statistics = statistics
        self._before = statistics.snapshot()
        self._advised: str | None = None
        # Not a lifecycle publisher: an inactive node has something to say, too.
        overrides = QoSOverridingOptions.with_default_policies()
        try:
            self._publisher = node.create_publisher(
                DiagnosticArray, "/diagnostics", QoSProfile(depth=10), qos_overriding_options=overrides
            )
        except (RuntimeError, ParameterException) as error:
            raise ParameterError(f"/diagnostics: {error}") from None

    def report(self, state: str, source: Input | None, input_timeout: float) -> None:
        """Publish the figures of this moment and compare them with those of the last report."""
        now = self._statistics.snapshot()
        stamp = self._node.get_clock().now().to_msg()
        name = self._node.get_fully_qualified_name()
        self._publisher.publish(diagnostics(stamp, name, state, now, self._before, input_timeout))
        self._before = now

        silent = state == "active" and 0 < input_timeout <= now.idle
        if silent and source is not None and (advice := self._advice(source.topic)) != self._advised:
            # Again where the advice changes, as when a camera has come up on another topic.
            self._node.get_logger().warning(f"no clouds on {source.topic} for {now.idle:.0f} s{advice}")
            self._advised = advice
        if self._advised is not None and not silent:
            if state == "active":
                self._node.get_logger().info("clouds are coming in")
            self._advised = None

    def _advice(self, topic: str) -> str:
        if publishers := self._node.count_publishers(topic):
            return f", although it has {publishers} publisher(s): are they publishing, with what QoS?"
        others = sorted(
            name
            for name, types in self._node.get_topic_names_and_types()
            if CLOUD_TYPE in types and self._node.count_publishers(name) and not self._own(name)
        )
        if not others:
            return ": nobody publishes sensor_msgs/PointCloud2; is the camera driver running?"
        remaps = " or ".join(f"-r points:={name}" for name in others[:4])
        return f": nobody publishes there; remap with --ros-args {remaps}"

    def _own(self, topic: str) -> bool:
        return any(publisher.topic_name == topic for publisher in self._node.publishers)
