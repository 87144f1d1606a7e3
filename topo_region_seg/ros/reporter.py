# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Once a second: diagnostics on a topic and, when no clouds come, a word of advice in the log."""

from __future__ import annotations

import time
from collections import deque
from contextlib import suppress
from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from topo_region_seg.ros.advice import advice
from topo_region_seg.ros.diagnostics import Condition, diagnostics
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.qos_overrides import overriding
from topo_region_seg.ros.statistics import Statistics

DROPS_OVER = 10
"""Reports, one a second, over which the share of dropped clouds is taken."""

HEARD_SECONDS = 2.0
"""Longest wait for somebody to listen to the last report, and again for it to be received, before the process ends."""

MATCHING_SECONDS = 0.3
"""Pause after a report, as a listener that the node knows may not know the node yet, and miss it."""


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
        self._earlier = deque([self._before], maxlen=DROPS_OVER)
        self._advised: str | None = None
        # Not a lifecycle publisher: an inactive node has something to say, too.
        self._publisher = node.create_publisher(
            DiagnosticArray,
            "/diagnostics",
            QoSProfile(depth=10),
            qos_overriding_options=overriding(node, "/diagnostics", "publisher"),
        )

    def report(self, condition: Condition, source: FrameSource | None) -> None:
        """Publish the figures of this moment, compared with those of the last reports.

        `source` is the input of a node that listens.
        """
        now = self._statistics.snapshot()
        heard = now.received > 0
        if source is not None and source.hears_the_past and heard:
            condition = replace(condition, latched=True)  # a publisher that latches owes no second cloud
        stamp = self._node.get_clock().now().to_msg()
        name = self._node.get_fully_qualified_name()
        self._publisher.publish(diagnostics(stamp, name, condition, now, self._before, self._earlier[0]))
        self._before = now
        self._earlier.append(now)

        silent = condition.silent(now)
        if silent and source is not None and (text := advice(self._node, source, heard)) != self._advised:
            # Again where the advice changes, as when a camera has come up on another topic.
            self._node.get_logger().warning(f"no {source.what} on {source.topic} for {now.idle:.0f} s{text}")
            self._advised = text
        if self._advised is not None and not silent:
            if condition.state == "active" and condition.asleep is None:
                what = "clouds" if source is None else source.what
                self._node.get_logger().info(f"{what} are coming in")
            self._advised = None

    def wait_for_listeners(self) -> None:
        """Wait a moment for those who listen to diagnostics, which a node that has just started may not know yet."""
        end = time.monotonic() + HEARD_SECONDS
        while not self._publisher.get_subscription_count() and time.monotonic() < end:
            time.sleep(0.05)

    def wait_until_heard(self) -> None:
        """Wait a moment for those who listen to receive the last report, and for who is about to listen."""
        time.sleep(MATCHING_SECONDS)
        with suppress(rclpy_implementation.RCLError):  # not every middleware can tell
            self._publisher.wait_for_all_acked(Duration(seconds=HEARD_SECONDS))
