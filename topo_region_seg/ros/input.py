# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The input topic and the worker thread behind it; exists only while the node is active.

A reliable subscription does not hear best-effort publishers; a best-effort one hears everybody, but Fast DDS then
loses most clouds of a megabyte and more. So the subscription is reliable until a best-effort publisher appears.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import (
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.processor import Frame
from topo_region_seg.ros.statistics import Statistics
from topo_region_seg.ros.transport import PROFILES, VARIABLE
from topo_region_seg.ros.worker import NewestWinsWorker

OVERLAP_SECONDS = 1.0
"""How long an old subscription outlives its successor: publishers must have discovered the new one by then."""


class Input:
    """Take clouds from `points`, depth 1, and process the newest.

    Parameters
    ----------
    node : LifecycleNode
        The node that subscribes.
    process : callable
        Called on the worker thread with each frame.
    statistics : Statistics
        Counts what arrives, is dropped and is lost.
    log : ReasonLog
        For publishers that cannot be heard, or not well.
    reliability : str
        "auto" follows the publishers; "best_effort" and "reliable" stay. The QoS override for the topic's
        reliability goes before it.
    """

    def __init__(
        self,
        node: LifecycleNode,
        process: Callable[[Frame], None],
        statistics: Statistics,
        log: ReasonLog,
        reliability: str,
    ) -> None:
        self._node = node
        self._statistics = statistics
        self._log = log
        override = f"qos_overrides.{self.topic}.subscription.reliability"
        self._policies = [QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.DURABILITY]
        if override in node._parameter_overrides:
            # Declared only where it is given: a declared one holds the value of the first subscription for good.
            self._policies.append(QoSPolicyKind.RELIABILITY)
            reliability = "reliable"
        self._follows = reliability == "auto"
        self._publishers = 0
        self._reliability = ReliabilityPolicy[reliability.upper()] if reliability != "auto" else self._wanted()
        self._recent: deque[tuple[int, int]] = deque(maxlen=16)
        self._last_number: int | None = None
        self._retired: Subscription | None = None
        self._switched = 0.0
        self._worker = NewestWinsWorker(process, "segmentation")
        # Whoever activates the node may do so on another thread than the one that gets the events.
        self._lock = threading.RLock()
        with self._lock:
            try:
                self._subscription = self._subscribe()
            except Exception:
                self._worker.stop()
                raise

    @property
    def topic(self) -> str:
        """Full name of the topic, remapping included."""
        return str(self._node.resolve_topic_name("points"))

    def follow_publishers(self) -> None:
        """Make the subscription best effort if a publisher is, else reliable; harmless to call at any time."""
        with self._lock:
            wanted = self._wanted()
            if self._retired is not None:
                if time.monotonic() - self._switched < OVERLAP_SECONDS:
                    return
                self._end_overlap()
            if self._follows and wanted != self._reliability:
                # The successor is there before the old subscription goes, so that no cloud falls between them.
                self._reliability = wanted
                self._retired, self._switched = self._subscription, time.monotonic()
                self._subscription = self._subscribe()
                self._node.get_logger().debug(f"subscription to {self.topic} is now {wanted.name.lower()}")

    def close(self, timeout: float) -> bool:
        """Unsubscribe, forget what waits, wait for the running frame; return whether it ended in time."""
        with self._lock:
            self._end_overlap()
            self._node.destroy_subscription(self._subscription)
        ended, forgot = self._worker.stop(timeout)
        if forgot:
            self._statistics.dropped()
        return ended

    def _wanted(self) -> ReliabilityPolicy:
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        self._publishers = len(publishers)
        modest = any(info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for info in publishers)
        return ReliabilityPolicy.BEST_EFFORT if modest else ReliabilityPolicy.RELIABLE

    def _subscribe(self) -> Subscription:
        profile = QoSProfile(depth=1, reliability=self._reliability)
        events = SubscriptionEventCallbacks(
            matched=self._note_match, incompatible_qos=self._warn_incompatible, message_lost=self._count_lost
        )
        overrides = QoSOverridingOptions(self._policies)

        def subscribe(**more: Any) -> Subscription:
            return self._node.create_subscription(
                PointCloud2, "points", self._receive, profile, qos_overriding_options=overrides, **more
            )

        try:
            return subscribe(event_callbacks=events)
        except UnsupportedEventTypeError:
            # Other middlewares: the once-a-second call of follow_publishers has to do.
            return subscribe()

    def _end_overlap(self) -> None:
        if self._retired is not None:
            self._node.destroy_subscription(self._retired)
            self._retired = None

    def _receive(self, msg: PointCloud2, info: dict[str, Any]) -> None:
        number = info["publication_sequence_number"]
        identity = info["source_timestamp"], number
        if identity in self._recent:
            return  # both subscriptions of an overlap have it
        last = number if self._last_number is None else self._last_number
        skipped = max(0, number - last - 1) if self._publishers == 1 else 0
        self._last_number = max(number, last)
        self._recent.append(identity)
        self._statistics.received(displaced=self._worker.submit(Frame(msg)), skipped=skipped)

    def _count_lost(self, event: QoSMessageLostInfo) -> None:
        self._statistics.lost(event.total_count_change)
        self._log.throttled(
            "lost_in_transport",
            f"clouds are lost between publisher and node on {self.topic} ({self._reliability.name.lower()} QoS); "
            f"publish reliably, or start the publisher with {VARIABLE}={PROFILES}",
        )

    def _note_match(self, _: object) -> None:
        self._last_number = None  # each publisher numbers its clouds anew
        self.follow_publishers()

    def _warn_incompatible(self, event: QoSRequestedIncompatibleQoSInfo) -> None:
        self.follow_publishers()
        policy = event.last_policy_kind
        if self._follows and policy == QoSPolicyKind.RELIABILITY:
            return
        self._statistics.incompatible(event.total_count_change)
        name = qos_policy_name_from_kind(policy).lower()
        mend = f"qos_overrides.{self.topic}.subscription.{name}"
        self._log.throttled(
            "incompatible_qos",
            f"a publisher on {self.topic} cannot be heard: its {name} is less than this node asks for; "
            f"set {'input_reliability to auto' if policy == QoSPolicyKind.RELIABILITY else mend}",
        )
