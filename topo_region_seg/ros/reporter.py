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
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from topo_region_seg.ros.advice import advice
from topo_region_seg.ros.diagnostics import Condition, diagnostics
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.qos_overrides import overriding

DROPS_OVER = 10
"""Reports, one a second, over which the share of dropped clouds is taken."""

HEARD_SECONDS = 2.0
"""Longest wait for somebody to listen to the last report, and again for it to be received, before the process ends."""

MATCHING_SECONDS = 0.3
"""Pause after a report, as a listener that the node knows may not know the node yet, and miss it."""


def diagnostics_publisher(node: LifecycleNode) -> Publisher:
    """Return the publisher of the node's diagnostics; reliable, depth 10, QoS overridable by parameters.

    Raises
    ------
    ParameterError
        If a QoS override for the topic is invalid.
    """
    # Not a lifecycle publisher: an inactive node has something to say, too.
    return node.create_publisher(
        DiagnosticArray,
        "/diagnostics",
        QoSProfile(depth=10),
        qos_overriding_options=overriding(node, "/diagnostics", "publisher"),
    )


class Reporter:
    """Publish what there is to say of a camera's frames, in every lifecycle state.

    Parameters
    ----------
    feed : Feed
        The camera's.
    publisher : Publisher
        That of the node's diagnostics.
    """

    def __init__(self, feed: Feed, publisher: Publisher) -> None:
        self._node = feed.node
        self._statistics = feed.statistics
        self._logger = feed.log.logger
        self._name = f"{feed.node.get_fully_qualified_name()}/{feed.name}".rstrip("/")
        self._before = self._statistics.snapshot()
        self._earlier = deque([self._before], maxlen=DROPS_OVER)
        self._advised: str | None = None
        self._publisher = publisher

    def report(self, condition: Condition, source: FrameSource | None) -> None:
        """Publish the figures of this moment, compared with those of the last reports.

        `source` is the input of a node that listens.
        """
        now = self._statistics.snapshot()
        heard = now.received > 0
        if source is not None and source.hears_the_past and heard:
            condition = replace(condition, latched=True)  # a publisher that latches owes no second cloud
        stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(diagnostics(stamp, self._name, condition, now, self._before, self._earlier[0]))
        self._before = now
        self._earlier.append(now)

        silent = condition.silent(now)
        if silent and source is not None and (text := advice(self._node, source, heard)) != self._advised:
            # Again where the advice changes, as when a camera has come up on another topic.
            self._logger.warning(f"no {source.what} on {source.topic} for {now.idle:.0f} s{text}")
            self._advised = text
        if self._advised is not None and not silent:
            if condition.state == "active" and condition.asleep is None:
                what = "clouds" if source is None else source.what
                self._logger.info(f"{what} are coming in")
            self._advised = None


def wait_for_listeners(publisher: Publisher) -> None:
    """Wait a moment for those who listen to diagnostics, which a node that has just started may not know yet."""
    end = time.monotonic() + HEARD_SECONDS
    while not publisher.get_subscription_count() and time.monotonic() < end:
        time.sleep(0.05)


def wait_until_heard(publisher: Publisher) -> None:
    """Wait a moment for those who listen to receive the last report, and for who is about to listen."""
    time.sleep(MATCHING_SECONDS)
    with suppress(rclpy_implementation.RCLError):  # not every middleware can tell
        publisher.wait_for_all_acked(Duration(seconds=HEARD_SECONDS))
