# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The input topic and the worker thread behind it; exists only while the node is active.

Nothing here is particular to one middleware: some number no messages, and some have no events.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.event_handler import (
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, qos_policy_name_from_kind
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.input_quality import InputQuality
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.processor import Frame
from topo_region_seg.ros.qos_overrides import overriding
from topo_region_seg.ros.statistics import Statistics
from topo_region_seg.ros.transport import PROFILES, VARIABLE, fast_dds
from topo_region_seg.ros.worker import NewestWinsWorker

OVERLAP_SECONDS = 1.0
"""How long an old subscription outlives its successor: publishers must have discovered the new one by then."""
REMEMBERED = 16
"""Clouds that are recognized when the second subscription of an overlap delivers them, too."""


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
        As :class:`InputQuality` takes it.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
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
        self.quality = InputQuality(node, self.topic, reliability)
        self._overrides = overriding(node, "points", "subscription", self.quality.overridable)
        self._present = self.quality.wanted()
        self._recent: deque[tuple[Any, ...]] = deque(maxlen=REMEMBERED)
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

    @property
    def hears_the_past(self) -> bool:
        """Whether it gets what was published before it was there, by publishers that keep it."""
        return bool(self._subscription.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL)

    def follow_publishers(self) -> None:
        """Give the subscription the quality that hears all publishers; harmless to call at any time."""
        with self._lock:
            wanted = self.quality.wanted()
            if self._retired is not None:
                if time.monotonic() - self._switched < OVERLAP_SECONDS:
                    return
                self._end_overlap()
            if wanted != self._present:
                # The successor is there before the old subscription goes, so that no cloud falls between them.
                self._present = wanted
                self._retired, self._switched = self._subscription, time.monotonic()
                self._subscription = self._subscribe()
                self._node.get_logger().debug(f"subscription to {self.topic} is now {wanted}")

    def close(self, timeout: float) -> bool:
        """Unsubscribe, forget what waits, wait for the running frame; return whether it ended in time."""
        with self._lock:
            self._end_overlap()
            self._node.destroy_subscription(self._subscription)
        ended, forgot = self._worker.stop(timeout)
        if forgot:
            self._statistics.dropped()
        return ended

    def _subscribe(self) -> Subscription:
        events = SubscriptionEventCallbacks(
            matched=self._note_match, incompatible_qos=self._warn_incompatible, message_lost=self._count_lost
        )

        def subscribe(**more: Any) -> Subscription:
            return self._node.create_subscription(
                PointCloud2,
                "points",
                self._receive,
                self._present.profile(),
                qos_overriding_options=self._overrides,
                **more,
            )

        try:
            return subscribe(event_callbacks=events)
        except UnsupportedEventTypeError:
            # The once-a-second call of follow_publishers has to do.
            return subscribe()

    def _end_overlap(self) -> None:
        if self._retired is not None:
            self._node.destroy_subscription(self._retired)
            self._retired = None

    def _receive(self, msg: PointCloud2, info: Mapping[str, Any]) -> None:
        number, published = info.get("publication_sequence_number"), info.get("source_timestamp")
        stamp = msg.header.stamp
        identity = (published, number, stamp.sec, stamp.nanosec)
        # Without number and time, equal stamps may also be those of a camera that has no clock.
        if identity in self._recent and (published or number is not None or self._retired is not None):
            return  # both subscriptions of an overlap have it
        self._recent.append(identity)
        skipped = 0
        if number is not None:
            last = number if self._last_number is None else self._last_number
            skipped = max(0, number - last - 1) if self.quality.publishers == 1 else 0
            self._last_number = max(number, last)
        self._statistics.received(displaced=self._worker.submit(Frame(msg)), skipped=skipped)

    def _count_lost(self, event: QoSMessageLostInfo) -> None:
        self._statistics.lost(event.total_count_change)
        segment = f", or start the publisher with {VARIABLE}={PROFILES}" if fast_dds() else ""
        self._log.throttled(
            "lost_in_transport",
            f"clouds are lost between publisher and node on {self.topic} ({self._present} QoS); "
            f"publish reliably{segment}",
        )

    def _note_match(self, _: object) -> None:
        self._last_number = None  # each publisher numbers its clouds from 1
        self.follow_publishers()

    def _warn_incompatible(self, event: QoSRequestedIncompatibleQoSInfo) -> None:
        self.follow_publishers()
        policy = event.last_policy_kind
        if policy in self.quality.followed:
            return
        self._statistics.incompatible(event.total_count_change)
        remedy = (
            "set input_reliability to auto"
            if policy == QoSPolicyKind.RELIABILITY and policy not in self.quality.overridable
            else f"change {self.quality.override(policy)}"
        )
        self._log.throttled(
            "incompatible_qos",
            f"a publisher on {self.topic} cannot be heard: its {qos_policy_name_from_kind(policy).lower()} is less "
            f"than this node asks for; {remedy}",
        )
