# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's output topics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecyclePublisher
from rclpy.qos import QoSProfile

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.topics import OUTPUTS, Output
from topo_region_seg.data import Cloud
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.qos_overrides import overriding
from topo_region_seg.ros.types import ros_types
from topo_region_seg.segmentation import Segmentation


class Outputs:
    """Lifecycle publishers of all that is said about a frame: reliable, depth 1, QoS overridable by parameters.

    Parameters
    ----------
    feed : Feed
        The camera's.
    pass_fields : callable
        Returns the names of the fields of the input that labeled clouds carry on.

    Attributes
    ----------
    missing : tuple of str
        Topics that are not published, as the package of their messages is missing.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
    """

    def __init__(self, feed: Feed, pass_fields: Callable[[], tuple[str, ...]]) -> None:
        self._node = feed.node
        self._log = feed.log
        self._pass_fields = pass_fields
        self._types = ros_types()
        self._publishers: list[tuple[Output, LifecyclePublisher]] = []
        self.missing: tuple[str, ...] = ()
        try:
            for output in OUTPUTS:
                kind = output.message_class(self._types)
                if kind is None:
                    self.missing += (output.name,)
                else:
                    self._publishers.append((output, self._create(kind, feed.topic(output.name))))
        except Exception:
            self.destroy()
            raise

    def wanted(self) -> bool:
        """Whether somebody subscribes to any of them."""
        return any(publisher.get_subscription_count() for _, publisher in self._publishers)

    def publish(self, msg: Any, cloud: Cloud, seg: Segmentation) -> list[str]:
        """Make and publish what somebody subscribes to, from the frame `msg`; return the names of these topics."""
        passed = self._pass_fields()
        if passed and not hasattr(msg, "fields"):
            self._log.once("no_fields", "pass_fields has no effect: depth images have no other fields")
            passed = ()
        answer = Answer(msg, cloud, seg, passed, self._log.once)
        published = []
        for output, publisher in self._publishers:
            if publisher.get_subscription_count() and (message := output.make(self._types, answer)) is not None:
                publisher.publish(message)
                published.append(output.name)
        return published

    def destroy(self) -> None:
        """Remove the topics."""
        for _, publisher in self._publishers:
            self._node.destroy_lifecycle_publisher(publisher)
        self._publishers.clear()

    def _create(self, kind: type, topic: str) -> LifecyclePublisher:
        return self._node.create_lifecycle_publisher(
            kind, topic, QoSProfile(depth=1), qos_overriding_options=overriding(self._node, topic, "publisher")
        )
